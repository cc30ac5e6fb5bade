// Archives of the small structs that others consist of.
#pragma once

#include "pocd/belief/belief.hpp"
#include "pocd/common/archive.hpp"
#include "pocd/common/types.hpp"
#include "pocd/objects/frame_result.hpp"

namespace pocd {

// Each names all members: one that is added does not compile until it is described.

template <class Archive>
void archive(Archive& a, Pose4& pose) {
  auto& [position_W, yaw_rad] = pose;
  a(position_W, yaw_rad);
}

template <class Archive>
void archive(Archive& a, OrientedBox& box) {
  auto& [pose, size_m] = box;
  a(pose, size_m);
}

template <class Archive>
void archive(Archive& a, Belief& belief) {
  auto& [mu, sigma, alpha, beta] = belief;
  a(mu, sigma, alpha, beta);
}

template <class Archive>
void archive(Archive& a, Evidence& evidence) {
  auto& [delta_m, stationarity_class, k, c1, c2, visible_share, seen_through_share,
         measurement_sigma_m, before, after, rule] = evidence;
  a(delta_m, stationarity_class, k, c1, c2, visible_share, seen_through_share, measurement_sigma_m,
    before, after, rule);
}

}  // namespace pocd
