#include "pocd/sim/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pocd/sim/triangle_mesh.hpp"

namespace pocd {

Pose upright_pose(const Eigen::Vector3d& position_m, double yaw_rad) {
  Pose T = Pose::Identity();
  T.translation() = position_m;
  T.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

OrientedBox bounding_box(const SceneObject& object) {
  const Eigen::Matrix3d& R = object.T_W_O.linear();
  OrientedBox box;
  box.pose.yaw_rad = std::atan2(R(1, 0), R(0, 0));
  const Pose T_H_W = upright_pose(object.T_W_O.translation(), box.pose.yaw_rad).inverse();
  Eigen::Array3d low = Eigen::Array3d::Constant(1e9), high = Eigen::Array3d::Constant(-1e9);
  for (const ScenePart& part : object.parts) {
    const Pose T_H_P = T_H_W * object.T_W_O * part.T_O_P;
    if (part.shape == Shape::kMesh) {
      for (const Eigen::Vector3f& vertex : part.mesh->vertices()) {
        const Eigen::Array3d p_H = T_H_P * vertex.cast<double>();
        low = low.min(p_H), high = high.max(p_H);
      }
      continue;
    }
    Eigen::Vector3d half = 0.5 * part.size_m;
    if (part.shape == Shape::kCylinder) half.y() = half.x();
    // A rotation's absolute values map half edges to the half extents of the enclosing box.
    Eigen::Vector3d extent = T_H_P.linear().cwiseAbs() * half;
    if (part.shape == Shape::kCylinder) {
      // The disc of radius r with unit normal n reaches r sqrt(1 - n_i^2) along axis i.
      const Eigen::Vector3d axis = T_H_P.linear().col(2);
      extent =
          (half.x() * (1.0 - axis.array().square()).max(0.0).sqrt() + half.z() * axis.array().abs())
              .matrix();
    }
    low = low.min((T_H_P.translation() - extent).array());
    high = high.max((T_H_P.translation() + extent).array());
  }
  if (object.parts.empty()) low = high = Eigen::Array3d::Zero();
  box.size_m = (high - low).matrix();
  box.pose.position_W = T_H_W.inverse() * (0.5 * (low + high)).matrix();
  return box;
}

Pose pose_at(const SceneObject& object, double time_s) {
  const std::vector<TrackPoint>& track = object.track;
  if (track.empty()) return object.T_W_O;
  const auto place = [&](const Eigen::Vector2d& xy, double yaw_rad) {
    return upright_pose({xy.x(), xy.y(), object.T_W_O.translation().z()}, yaw_rad);
  };
  if (time_s <= track.front().time_s) {
    return place(track.front().position_m, track.front().yaw_rad);
  }
  for (std::size_t i = 1; i < track.size(); ++i) {
    if (time_s > track[i].time_s) continue;
    const double span = track[i].time_s - track[i - 1].time_s;
    const double part = span > 0.0 ? (time_s - track[i - 1].time_s) / span : 1.0;
    return place(track[i - 1].position_m + part * (track[i].position_m - track[i - 1].position_m),
                 track[i - 1].yaw_rad + part * (track[i].yaw_rad - track[i - 1].yaw_rad));
  }
  return place(track.back().position_m, track.back().yaw_rad);
}

bool exists_at(const SceneObject& object, double time_s) {
  if (!object.transient || object.track.empty()) return !object.transient;
  return time_s >= object.track.front().time_s && time_s <= object.track.back().time_s;
}

bool boxes_overlap(const OrientedBox& a, const OrientedBox& b, double tolerance_m) {
  const double gap_z =
      std::abs(a.pose.position_W.z() - b.pose.position_W.z()) - 0.5 * (a.size_m.z() + b.size_m.z());
  if (gap_z > -tolerance_m) return false;
  const auto axes = [](const OrientedBox& box) {
    const double c = std::cos(box.pose.yaw_rad), s = std::sin(box.pose.yaw_rad);
    return std::array<Eigen::Vector2d, 2>{Eigen::Vector2d(c, s), Eigen::Vector2d(-s, c)};
  };
  const auto axes_a = axes(a), axes_b = axes(b);
  const Eigen::Vector2d between = (b.pose.position_W - a.pose.position_W).head<2>();
  for (const Eigen::Vector2d& axis : {axes_a[0], axes_a[1], axes_b[0], axes_b[1]}) {
    const auto reach = [&](const OrientedBox& box, const std::array<Eigen::Vector2d, 2>& u) {
      return 0.5 * (box.size_m.x() * std::abs(u[0].dot(axis)) +
                    box.size_m.y() * std::abs(u[1].dot(axis)));
    };
    const double gap = std::abs(between.dot(axis)) - reach(a, axes_a) - reach(b, axes_b);
    if (gap > -tolerance_m) return false;
  }
  return true;
}

}  // namespace pocd
