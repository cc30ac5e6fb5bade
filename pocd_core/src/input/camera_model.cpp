#include "pocd/input/camera_model.hpp"

#include <cmath>
#include <string>

#include "pocd/common/check.hpp"

namespace pocd {

void validate(const CameraModel& camera, const std::string& source) {
  const auto fail = [&](const char* field, double value, const char* rule) {
    throw InputError(source + ": camera " + field + " = " + std::to_string(value) + ", " + rule);
  };
  if (camera.width < 1 || camera.width > 16384) fail("width", camera.width, "not in [1, 16384]");
  if (camera.height < 1 || camera.height > 16384)
    fail("height", camera.height, "not in [1, 16384]");
  if (!(std::isfinite(camera.fx) && camera.fx > 0.0))
    fail("fx", camera.fx, "must be finite and > 0");
  if (!(std::isfinite(camera.fy) && camera.fy > 0.0))
    fail("fy", camera.fy, "must be finite and > 0");
  if (!std::isfinite(camera.cx)) fail("cx", camera.cx, "must be finite");
  if (!std::isfinite(camera.cy)) fail("cy", camera.cy, "must be finite");
}

}  // namespace pocd
