#include "pocd/input/pose_quaternion.hpp"

namespace pocd {

PoseQuaternion to_quaternion(const Pose& T) {
  PoseQuaternion pose;
  pose.position = T.translation();
  pose.rotation = Eigen::Quaterniond(T.linear()).normalized();
  if (pose.rotation.w() < 0.0) pose.rotation.coeffs() = -pose.rotation.coeffs();
  return pose;
}

Pose to_pose(const PoseQuaternion& pose) {
  Pose T = Pose::Identity();
  T.linear() = pose.rotation.toRotationMatrix();
  T.translation() = pose.position;
  return T;
}

PoseQuaternion interpolate(const PoseQuaternion& a, const PoseQuaternion& b, double t) {
  PoseQuaternion pose;
  pose.position = a.position + t * (b.position - a.position);
  pose.rotation = a.rotation.slerp(t, b.rotation).normalized();
  return pose;
}

Pose through_messages(const Pose& T_W_C, const Pose& T_B_C) {
  const Pose T_W_B = T_W_C * T_B_C.inverse();
  return to_pose(to_quaternion(T_W_B)) * to_pose(to_quaternion(T_B_C));
}

}  // namespace pocd
