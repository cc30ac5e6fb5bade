// ObjectTracker: the motion that took what departed to where something was found.
#include <algorithm>
#include <cmath>

#include "motion_starts.hpp"
#include "pocd/registration/point_to_plane_icp.hpp"
#include "tracker_step.hpp"

namespace pocd {
namespace {

/// At most this share of the new surface lies off the old one, moved there: on sides that were not
/// known.
constexpr double kUnseenShare = 0.5;
/// The same of what is seen better since it was told: more of its sides are known.
constexpr double kUnseenShareAgain = 0.8;
/// At most this share of it lies even outside of the old one's box, unless at least kWholeShare of
/// the old surface is seen at the new place: the box was that of a part.
constexpr double kBesideShare = 0.2;
constexpr double kWholeShare = 0.6;
/// Of what is known of the old surface at the new place, at most this share lies where nothing is:
/// some of it may have been seen empty before the thing came.
constexpr double kEmptyShare = 0.25;
/// At least this share of the old surface, moved, is seen at the new place.
constexpr double kSeenShare = 0.2;
/// When less than kWholeShare of a thing is seen, in a place that was not seen empty before, it
/// fits surely and has turned by less than kShiftRad: else it may be what the old one hid. It fits
/// surely when at least kSureFit of the new surface has a place on the old body, and nothing speaks
/// against the rest.
constexpr double kSureFit = 0.9;
constexpr double kShiftRad = M_PI / 4.0;
/// Motions that agree with this much less of what is known explain it as well; when they put the
/// thing's middle elsewhere by more than this share of its length, nothing is known of where it is.
constexpr double kSameFit = 0.03;
constexpr double kSlideShare = 0.25;
/// A point of one surface, moved, is on the other one within so many voxels.
constexpr double kOnVoxels = 1.5;
/// Points of the new surface that are aligned.
constexpr std::size_t kAlignPoints = 600;

}  // namespace

std::optional<Motion> ObjectTracker::explanation(const Step& step, const Departure& departure,
                                                 const LibraryObject& found,
                                                 const IcpTarget& target, const Points& source,
                                                 const IcpResult& icp) const {
  const auto all = static_cast<double>(departure.surfels.size());
  const double inlier_m = kOnVoxels * config_.map.voxel_size_m;
  Motion motion;
  motion.T_new_old = icp.T_target_source.inverse();
  double moved_m = 0.0;  // of its points: what turns in place moves, too
  for (const Surfel& s : departure.surfels) {
    const Eigen::Vector3d p = s.point_W.cast<double>();
    moved_m += (motion.T_new_old * p - p).norm();
  }
  moved_m /= all;
  if (moved_m > config_.state.relocation_reach_m || moved_m < 0.5 * config_.change.tau_m)
    return std::nullopt;
  motion.lengths = moved_m / longest_side(departure.box);
  // What of the old surface is at the new place, and what is not. What the new thing hides may have
  // been seen empty before it came.
  const Pose T_C_W = step.cloud.T_W_C.inverse();
  const double hidden_m = config_.map.voxel_size_m;
  const auto hidden = [&](const Eigen::Vector3f& point_W) {
    const auto view = view_of(step.cloud, T_C_W, point_W.cast<double>());
    return view && view->measured_m > 0.0 && view->measured_m < view->depth_m - hidden_m;
  };
  const Eigen::Isometry3f T = motion.T_new_old.cast<float>();
  std::size_t empty = 0, seen = 0;
  for (const Surfel& s : departure.surfels) {
    const Eigen::Vector3f there = T * s.point_W;
    if (found.model.nearest(there, static_cast<float>(inlier_m)) != ObjectModel::kNone) {
      ++seen;
    } else if (free_space_.seen_empty(there) && !hidden(there)) {
      ++empty;
    }
  }
  motion.seen = static_cast<double>(seen) / all;
  const double contradicted =
      static_cast<double>(empty) / std::max(1.0, static_cast<double>(seen + empty));
  if (contradicted > kEmptyShare) return std::nullopt;
  motion.fit = 1.0 - icp.dissimilarity - contradicted;
  // What of the new surface the old box has no room for, and what lies within the old body: all
  // else is on its surface, or on a side of it that was not known.
  std::size_t beside = 0, within = 0;
  for (const auto& p : source) {
    const Eigen::Vector3f there = (icp.T_target_source * p.cast<double>()).cast<float>();
    if (target.nearest(there - target.origin_W().cast<float>())) continue;
    beside += !is_inside(departure.box, inlier_m, there);
    within += is_inside(departure.box, -2.0 * inlier_m, there);
  }
  const double placed =
      1.0 - static_cast<double>(beside + within) / static_cast<double>(source.size());
  motion.fits_surely = placed - contradicted >= kSureFit;
  if (static_cast<double>(beside) > kBesideShare * static_cast<double>(source.size()) &&
      motion.seen < kWholeShare) {
    return std::nullopt;
  }
  return motion;
}

std::vector<Motion> ObjectTracker::motions_of(const Step& step, const Departure& departure,
                                              const LibraryObject& found, Asked asked) const {
  if (departure.class_id != found.class_id || departure.id == found.id) return {};
  if (found.id != ObjectId::kNone && departure.is_not == found.id) return {};
  if (were_both_there(departure, found, config_.state.visit_gap_s, config_.map.voxel_size_m))
    return {};
  const double slack_m = 3.0 * config_.map.voxel_size_m;
  const double distance_m =
      (departure.box.pose.position_W - found.box.pose.position_W).head<2>().norm();
  // Of each only a part may be known: how far it went is told by the alignment.
  const double parts_m =
      0.5 * (departure.box.size_m.head<2>().norm() + found.box.size_m.head<2>().norm());
  if (distance_m > config_.state.relocation_reach_m + parts_m) return {};
  if (!stands_as_high(found.box, departure.box, slack_m)) return {};
  // Of a thing with a class only a part may have been known; without one, what is larger when it is
  // found is another.
  const bool has_class = found.class_id != kThing;
  if (!has_class && asked == Asked::kFirst && is_larger(found.box, departure.box, slack_m))
    return {};
  const double unseen_share =
      has_class && asked == Asked::kAgain ? kUnseenShareAgain : kUnseenShare;

  Points source;
  const auto& surfels = found.model.surfels();
  const std::size_t stride = std::max<std::size_t>(1, surfels.size() / kAlignPoints);
  for (std::size_t i = 0; i < surfels.size(); i += stride) source.push_back(surfels[i].point_W);
  const double inlier_m = kOnVoxels * config_.map.voxel_size_m;
  const IcpTarget target = icp_target(departure.surfels, inlier_m,
                                      std::max(inlier_m, config_.association.icp_max_distance_m));
  IcpOptions options;
  options.max_iterations = config_.association.icp_iterations;
  options.robust_scale_m = config_.map.voxel_size_m;
  const std::vector<Pose> starts = likely_starts(departure.box, found.box, target, source);
  std::vector<Motion> motions;
  for (const Pose& start : starts) {
    const IcpResult icp = point_to_plane_icp(target, source, options, start);
    if (icp.dissimilarity > unseen_share) continue;
    if (const auto motion = explanation(step, departure, found, target, source, icp))
      motions.push_back(*motion);
  }
  return motions;
}

std::optional<Motion> ObjectTracker::motion_of(const Step& step, const Departure& departure,
                                               const LibraryObject& found) const {
  return likeliest(motions_of(step, departure, found, Asked::kFirst), departure, found.arrival);
}

std::optional<Motion> ObjectTracker::likeliest(const std::vector<Motion>& motions,
                                               const Departure& departure, Arrival arrival) {
  const auto best = std::max_element(
      motions.begin(), motions.end(),
      [](const Motion& a, const Motion& b) { return a.likelihood() < b.likelihood(); });
  // It must be seen well enough; a worse one is no answer until then.
  if (best == motions.end() || best->seen < kSeenShare) return std::nullopt;
  if (best->seen >= kWholeShare) return *best;
  if (arrival != Arrival::kArrived &&
      (!best->fits_surely || Eigen::AngleAxisd(best->T_new_old.linear()).angle() > kShiftRad)) {
    return std::nullopt;
  }
  // Of a small part of a flat face nobody can tell how far it slid.
  const auto centre_of = [&](const Motion& motion) -> Eigen::Vector3d {
    return motion.T_new_old * departure.box.pose.position_W;
  };
  for (const Motion& other : motions) {
    if (other.fit > best->fit - kSameFit &&
        (centre_of(other) - centre_of(*best)).norm() > kSlideShare * longest_side(departure.box))
      return std::nullopt;
  }
  return *best;
}

}  // namespace pocd
