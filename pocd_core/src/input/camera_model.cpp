#include "pocd/input/camera_model.hpp"

#include <cmath>
#include <string>

#include "pocd/common/check.hpp"

namespace pocd {

namespace {

std::string fault(const char* field, double value, const std::string& rule) {
  return "camera " + std::string(field) + " = " + std::to_string(value) + ", " + rule;
}

std::string range_text(double low, double high) {
  return "not in [" + std::to_string(low) + ", " + std::to_string(high) + "]";
}

}  // namespace

std::string camera_fault(const CameraModel& camera) {
  constexpr double kShortest = 0.05, kLongest = 100.0;
  struct Axis {
    const char *size_name, *focal_name, *centre_name;
    int size;
    double focal, centre;
  };
  const Axis axes[] = {{"width", "fx", "cx", camera.width, camera.fx, camera.cx},
                       {"height", "fy", "cy", camera.height, camera.fy, camera.cy}};
  for (const Axis& axis : axes) {
    if (axis.size < 1 || axis.size > kLargestSide_px) {
      return fault(axis.size_name, axis.size,
                   "not in [1, " + std::to_string(kLargestSide_px) + "]");
    }
  }
  for (const Axis& axis : axes) {
    if (!std::isfinite(axis.focal) || axis.focal <= 0.0) {
      return fault(axis.focal_name, axis.focal, "must be finite and > 0");
    }
    if (!std::isfinite(axis.centre)) return fault(axis.centre_name, axis.centre, "must be finite");
  }
  for (const Axis& axis : axes) {
    const double size = axis.size;
    if (axis.focal < kShortest * size || axis.focal > kLongest * size) {
      return fault(axis.focal_name, axis.focal, range_text(kShortest * size, kLongest * size));
    }
    if (axis.centre < -size || axis.centre > 2.0 * size) {
      return fault(axis.centre_name, axis.centre, range_text(-size, 2.0 * size));
    }
  }
  return "";
}

void validate(const CameraModel& camera, const std::string& source) {
  const std::string fault = camera_fault(camera);
  if (!fault.empty()) throw InputError(source + ": " + fault);
}

}  // namespace pocd
