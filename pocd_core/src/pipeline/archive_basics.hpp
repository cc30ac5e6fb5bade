// Archives of the small structs that others consist of.
#pragma once

#include "pocd/common/archive.hpp"
#include "pocd/common/types.hpp"
#include "pocd/input/camera_model.hpp"
#include "pocd/state/object_state.hpp"

namespace pocd {

template <class Archive>
void archive(Archive& a, Pose4& p) {
  a(p.position_W, p.yaw_rad);
}

template <class Archive>
void archive(Archive& a, OrientedBox& b) {
  a(b.pose, b.size_m);
}

template <class Archive>
void archive(Archive& a, Belief& b) {
  a(b.mu, b.sigma, b.alpha, b.beta);
}

template <class Archive>
void archive(Archive& a, CameraModel& c) {
  a(c.width, c.height, c.fx, c.fy, c.cx, c.cy);
}

}  // namespace pocd
