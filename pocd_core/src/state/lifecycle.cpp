#include "pocd/state/lifecycle.hpp"

#include <algorithm>
#include <cmath>

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

Belief next_belief(const Belief& before, const Measurement& measurement, const StateConfig& state,
                   const ChangeConfig& change) {
  Belief after = bayesian_update(before, measurement, change.delta_max_m).belief;
  if (after.stationarity() > state.max_stationarity && after.stationarity() > before.stationarity())
    return before;
  after = clamp_counts(after, state.max_count);
  after.sigma = std::max(after.sigma, state.min_sigma_share * change.tau_m);
  return after;
}

Evidence apply_measurement(LibraryObject& object, double delta_m, double sigma_m,
                           const Sighting& sighting, const StateConfig& state,
                           const ChangeConfig& change) {
  Evidence evidence;
  evidence.delta_m = std::clamp(delta_m, -change.delta_max_m, change.delta_max_m);
  evidence.stationarity_class = object.stationarity_class;
  evidence.measurement_sigma_m = sigma_m;
  evidence.visible_share = sighting.visible_share();
  evidence.seen_through_share = sighting.seen_through_share();
  evidence.before = object.belief;
  Measurement measurement{evidence.delta_m, object.stationarity_class, sigma_m, 0.0};
  measurement.k = adaptive_k(object.belief, measurement, change.delta_max_m, state.k);
  evidence.k = measurement.k;
  const UpdateResult update = bayesian_update(object.belief, measurement, change.delta_max_m);
  evidence.c1 = update.c1;
  evidence.c2 = update.c2;
  object.belief = next_belief(object.belief, measurement, state, change);
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

bool same_side(const OrientedBox& part, const OrientedBox& whole, double slack_m) {
  const Eigen::Vector3d p = sorted_size(part), w = sorted_size(whole);
  const auto same = [&](double a, double b) {
    return std::abs(a - b) <= std::max(slack_m, 0.2 * std::max(a, b));
  };
  return same(p[2], w[2]) && (same(p[0], w[0]) || same(p[0], w[1]));
}

bool hides(const OrientedBox& box, const Eigen::Vector3d& eye_W, const Eigen::Vector3d& point_W) {
  const Eigen::AngleAxisd turn(-box.pose.yaw_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d from = turn * (eye_W - box.pose.position_W);
  const Eigen::Vector3d along = turn * (point_W - eye_W);
  // Shares of the way at which the line is between the sides of each axis.
  double enter = 0.0, leave = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double half_m = 0.5 * box.size_m[axis];
    if (std::abs(along[axis]) < 1e-9) {
      if (std::abs(from[axis]) > half_m) return false;
      continue;
    }
    const double a = (-half_m - from[axis]) / along[axis], b = (half_m - from[axis]) / along[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

OrientedBox filled(const OrientedBox& box, const Eigen::Vector3d& eye_W, double least_m) {
  OrientedBox result = box;
  const Eigen::Vector3d away_W = box.pose.position_W - eye_W;
  for (int axis = 0; axis < 2; ++axis) {
    const double missing = least_m - box.size_m[axis];
    if (missing <= 0.0) continue;
    const double yaw = box.pose.yaw_rad + (axis == 0 ? 0.0 : 0.5 * M_PI);
    Eigen::Vector3d direction_W(std::cos(yaw), std::sin(yaw), 0.0);
    if (direction_W.dot(away_W) < 0.0) direction_W = -direction_W;
    result.pose.position_W += 0.5 * missing * direction_W;
    result.size_m[axis] = least_m;
  }
  return result;
}

OrientedBox completed_box(const OrientedBox& part, const OrientedBox& known,
                          const Eigen::Vector3d& eye_W, double least_m) {
  // Sizes of the known box along the axes of the part.
  const double turn = std::cos(part.pose.yaw_rad - known.pose.yaw_rad);
  const bool swapped = std::abs(turn) < M_SQRT1_2;
  OrientedBox box = part;
  for (int axis = 0; axis < 2; ++axis) {
    const double yaw = part.pose.yaw_rad + (axis == 0 ? 0.0 : 0.5 * M_PI);
    const Eigen::Vector3d along_W(std::cos(yaw), std::sin(yaw), 0.0);
    const double whole_m = std::max(known.size_m[swapped ? 1 - axis : axis], part.size_m[axis]);
    const double slack_m = 0.5 * (whole_m - part.size_m[axis]);
    const double eye_m = (eye_W - part.pose.position_W).dot(along_W);
    const bool depth = part.size_m[axis] < least_m && std::abs(eye_m) > 0.5 * part.size_m[axis] &&
                       part.size_m[axis] < part.size_m[1 - axis];
    const double old_m = (known.pose.position_W - part.pose.position_W).dot(along_W);
    const double move_m =
        depth ? (eye_m > 0.0 ? -slack_m : slack_m) : std::clamp(old_m, -slack_m, slack_m);
    box.pose.position_W += move_m * along_W;
    box.size_m[axis] = whole_m;
  }
  const double bottom_m = part.pose.position_W.z() - 0.5 * part.size_m.z();
  box.size_m.z() = std::max(part.size_m.z(), known.size_m.z());
  box.pose.position_W.z() = bottom_m + 0.5 * box.size_m.z();
  return box;
}

const std::deque<RelocationMemory::Removed>& RelocationMemory::recent(StampNs now_ns,
                                                                      double window_s) {
  const auto window_ns = static_cast<StampNs>(window_s * 1e9);
  while (!removed_.empty() && now_ns - removed_.front().removed_ns > window_ns)
    removed_.pop_front();
  return removed_;
}

void RelocationMemory::set_clock_back(StampNs latest_ns) {
  for (Removed& r : removed_) {
    for (StampNs* stamp_ns :
         {&r.first_seen_ns, &r.verified_ns, &r.contested_since_ns, &r.removed_ns}) {
      *stamp_ns = std::min(*stamp_ns, latest_ns);
    }
  }
}

void RelocationMemory::forget(ObjectId id) {
  removed_.erase(std::remove_if(removed_.begin(), removed_.end(),
                                [&](const Removed& r) { return r.id == id; }),
                 removed_.end());
}

}  // namespace pocd
