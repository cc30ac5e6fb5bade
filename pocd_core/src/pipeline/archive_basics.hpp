// Archives of the small structs that others consist of.
#pragma once

#include "pocd/common/archive.hpp"
#include "pocd/common/types.hpp"
#include "pocd/pipeline/frame_result.hpp"
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
void archive(Archive& a, Evidence& e) {
  a(e.delta_m, e.stationarity_class, e.k, e.c1, e.c2, e.visible_share, e.seen_through_share,
    e.measurement_sigma_m, e.before, e.after, e.rule);
}

}  // namespace pocd
