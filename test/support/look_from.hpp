// Where tests put their cameras.
#pragma once

#include "pocd/common/types.hpp"

namespace pocd::test {

/// Camera at `eye_W` looking along +y of the map, turned left by yaw and pitched down [rad].
inline Pose look_from(const Eigen::Vector3d& eye_W, double yaw_rad = 0.0, double pitch_rad = 0.3) {
  Eigen::Matrix3d R_level;  // columns: optical x, y, z in the map frame
  R_level << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  Pose T_W_C = Pose::Identity();
  T_W_C.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * R_level *
                   Eigen::AngleAxisd(-pitch_rad, Eigen::Vector3d::UnitX());
  T_W_C.translation() = eye_W;
  return T_W_C;
}

}  // namespace pocd::test
