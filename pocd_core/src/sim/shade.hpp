// Paints hits of a rendered view: Lambert light from a fixed direction and simple procedural
// textures.
#pragma once

#include <cstdint>
#include <opencv2/core/matx.hpp>
#include <vector>

#include "pocd/input/camera_model.hpp"
#include "pocd/sim/scene.hpp"

namespace pocd {

/// Thread-safe once built.
class Shader {
 public:
  Shader(const Scene& scene, const CameraModel& camera, const Pose& T_W_C);

  /// depth_m and part_id as in RenderedFrame; part_id < 0 is painted as a dark hall.
  void shade_row(int v, const float* depth_m, const std::int32_t* part_id, cv::Vec3b* bgr) const;

 private:
  struct PaintedPart {
    const ScenePart* part;
    Eigen::Matrix3f R_W_P;
    Eigen::Matrix3f R_P_C;
    Eigen::Vector3f camera_P;
  };

  std::vector<PaintedPart> parts_;
  CameraModel camera_;
};

}  // namespace pocd
