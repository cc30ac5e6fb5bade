#include "pocd/state/lifecycle.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/state/bayesian_update.hpp"

namespace pocd {
namespace {

/// A candidate that was seen through in this many frames was never there (or moves).
constexpr int kCandidateGoneFrames = 2;
/// An object that lost more than this share of its points to erosion is gone.
constexpr double kLeastSurfelShare = 0.15;

/// Longer horizontal side, shorter one, height.
Eigen::Vector3d sorted_size(const OrientedBox& box) {
  const double x = box.size_m.x(), y = box.size_m.y();
  return {std::max(x, y), std::min(x, y), box.size_m.z()};
}

}  // namespace

Belief next_belief(const Belief& before, double delta_m, int stationarity_class, double k,
                   const StateConfig& state, const ChangeConfig& change) {
  const Measurement measurement{delta_m, stationarity_class, change.tau_m, k};
  Belief after = bayesian_update(before, measurement, change.delta_max_m).belief;
  if (after.stationarity() > state.max_stationarity) return before;
  after = clamp_counts(after, state.max_count);
  after.sigma = std::max(after.sigma, state.min_sigma_share * change.tau_m);
  return after;
}

Evidence apply_measurement(LibraryObject& object, double delta_m, const Sighting& sighting,
                           const StateConfig& state, const ChangeConfig& change) {
  Evidence evidence;
  evidence.delta_m = std::clamp(delta_m, -change.delta_max_m, change.delta_max_m);
  evidence.stationarity_class = object.stationarity_class;
  evidence.measurement_sigma_m = change.tau_m;
  evidence.visible_share = sighting.visible_share();
  evidence.seen_through_share = sighting.seen_through_share();
  evidence.before = object.belief;
  Measurement measurement{evidence.delta_m, object.stationarity_class, change.tau_m, 0.0};
  measurement.k = adaptive_k(object.belief, measurement, change.delta_max_m, state.k);
  evidence.k = measurement.k;
  const UpdateResult update = bayesian_update(object.belief, measurement, change.delta_max_m);
  evidence.c1 = update.c1;
  evidence.c2 = update.c2;
  object.belief = next_belief(object.belief, evidence.delta_m, object.stationarity_class,
                              evidence.k, state, change);
  evidence.after = object.belief;
  return evidence;
}

std::optional<std::string> removal_rule(const LibraryObject& object, const StateConfig& state,
                                        const ChangeConfig& change) {
  if (object.belief.stationarity() < state.remove_below) return "stationarity_below_threshold";
  // Beyond the distance that verifies an object, by more than the belief's drift under noise.
  if (object.confirmed && std::abs(object.belief.mu) > 0.6 * change.tau_m &&
      object.observations > 0 && object.belief.sigma < std::abs(object.belief.mu)) {
    return "change_established";
  }
  if (static_cast<double>(object.model.surfels().size()) <
      kLeastSurfelShare * static_cast<double>(object.most_surfels)) {
    return "nothing_left";
  }
  if (!object.confirmed) {
    if (object.frames_seen_through >= kCandidateGoneFrames) return "candidate_seen_through";
    if (object.frames_in_view > state.tentative_frames) return "never_confirmed";
  }
  return std::nullopt;
}

bool alike(const OrientedBox& a, const OrientedBox& b, double slack_m) {
  const Eigen::Vector3d sa = sorted_size(a), sb = sorted_size(b);
  for (int i = 0; i < 3; ++i) {
    if (std::abs(sa[i] - sb[i]) > std::max(slack_m, 0.35 * std::max(sa[i], sb[i]))) return false;
  }
  return true;
}

bool fits_inside(const OrientedBox& part, const OrientedBox& whole, double slack_m) {
  const Eigen::Vector3d p = sorted_size(part), w = sorted_size(whole);
  for (int i = 0; i < 3; ++i) {
    if (p[i] > w[i] + std::max(slack_m, 0.2 * w[i])) return false;
  }
  return true;
}

const RelocationMemory::Removed* RelocationMemory::find(ClassId class_id, const OrientedBox& box,
                                                        StampNs now_ns, double window_s,
                                                        double reach_m, double slack_m) {
  const auto window_ns = static_cast<StampNs>(window_s * 1e9);
  while (!removed_.empty() && now_ns - removed_.front().removed_ns > window_ns)
    removed_.pop_front();
  const Removed* best = nullptr;
  double best_distance = 0.0;
  for (const Removed& removed : removed_) {
    if (removed.class_id != class_id) continue;
    const double distance = (removed.box.pose.position_W - box.pose.position_W).head<2>().norm();
    if (!alike(removed.box, box, slack_m) &&
        !(distance <= reach_m && fits_inside(box, removed.box, slack_m))) {
      continue;
    }
    if (!best || distance < best_distance) best = &removed, best_distance = distance;
  }
  return best;
}

void RelocationMemory::forget(ObjectId id) {
  removed_.erase(std::remove_if(removed_.begin(), removed_.end(),
                                [&](const Removed& r) { return r.id == id; }),
                 removed_.end());
}

}  // namespace pocd
