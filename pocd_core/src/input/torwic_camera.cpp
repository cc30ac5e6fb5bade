#include "pocd/input/torwic_camera.hpp"

namespace pocd {

CameraModel torwic_camera() {
  return {640, 360, 461.0956115722656, 460.9181823730469, 325.4782409667969, 177.57662963867188};
}

CameraExtrinsics torwic_extrinsics() {
  CameraExtrinsics extrinsics;
  extrinsics.camera_frame = "realsense_front_camera_color_optical_frame";
  extrinsics.T_B_C.translation() = Eigen::Vector3d(0.520, 0.032, 0.011);
  extrinsics.T_B_C.linear() =
      Eigen::Quaterniond(0.561, -0.431, 0.429, -0.562).normalized().toRotationMatrix();
  return extrinsics;
}

}  // namespace pocd
