// Identifiers, stamps and labels: strong where mixing them up would compile.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pocd {

/// Time since the epoch of the data [ns]. Core never reads a clock: time comes with the frame.
using StampNs = std::int64_t;

/// Semantic class index as in the segmentation image, before any configuration gives it a meaning.
using ClassId = std::uint16_t;

/// An object of the library. 0 is "no object" (background). Never used twice within a run.
enum class ObjectId : std::uint32_t { kNone = 0 };

constexpr std::uint32_t to_index(ObjectId id) { return static_cast<std::uint32_t>(id); }

/// Rigid transform; named T_target_source. Translation in metres.
using Pose = Eigen::Isometry3d;

using Points = std::vector<Eigen::Vector3f>;

/// Pose of an object: centre of its box in the map frame [m] and heading about +z [rad, (-pi, pi]].
struct Pose4 {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

/// Upright box: `size_m` along the heading, across it, and up. All sizes >= 0 [m].
struct OrientedBox {
  Pose4 pose;
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
};

/// Length of the box's longer horizontal side [m].
inline double longest_side(const OrientedBox& box) { return box.size_m.head<2>().maxCoeff(); }

/// Direction of that side, a unit vector [W].
inline Eigen::Vector3d long_axis(const OrientedBox& box) {
  const double yaw_rad = box.pose.yaw_rad + (box.size_m.x() < box.size_m.y() ? M_PI_2 : 0.0);
  return {std::cos(yaw_rad), std::sin(yaw_rad), 0.0};
}

}  // namespace pocd
