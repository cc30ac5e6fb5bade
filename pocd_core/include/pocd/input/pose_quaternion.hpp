// Poses as position and unit quaternion, the way they travel in messages and files.
#pragma once

#include <Eigen/Geometry>

#include "pocd/common/types.hpp"

namespace pocd {

/// Position [m] and rotation of T_target_source; the quaternion has unit length.
struct PoseQuaternion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

/// The quaternion with w >= 0.
PoseQuaternion to_quaternion(const Pose& T);
Pose to_pose(const PoseQuaternion& pose);

/// Between a (t = 0) and b (t = 1): linear position, spherical linear rotation. t may leave [0, 1].
PoseQuaternion interpolate(const PoseQuaternion& a, const PoseQuaternion& b, double t);

/// T_W_C after the way it takes over a bus: split into T_W_B and T_B_C, each written as a quaternion,
/// read back and multiplied. It differs from T_W_C by rounding only; a frame that did not travel has
/// to go through this, too, to give the same map bit by bit.
Pose through_messages(const Pose& T_W_C, const Pose& T_B_C);

}  // namespace pocd
