// ObjectTracker: what departed and what arrived, and whether they are one thing.
#include <algorithm>
#include <cmath>

#include "motion_starts.hpp"
#include "pocd/observe/align_in_place.hpp"
#include "pocd/registration/point_to_plane_icp.hpp"
#include "tracker_step.hpp"

namespace pocd {
namespace {

/// At most this share of the new surface lies off the old one, moved there: on sides that were not
/// known.
constexpr double kUnseenShare = 0.5;
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
/// So far, in its lengths or in shares of the reach, a move is told at once.
constexpr double kAtOnceShare = 1.0;
constexpr double kAtOnceReachShare = 1.0 / 3.0;
/// A longer one is told after this time: another origin may be nearer [s].
constexpr double kFarWaitS = 1.0;
/// Motions that agree with this much less of what is known explain it as well; when they put the
/// thing's middle elsewhere by more than this share of its length, nothing is known of where it is.
constexpr double kSameFit = 0.03;
constexpr double kSlideShare = 0.25;
/// A point of one surface, moved, is on the other one within so many voxels.
constexpr double kOnVoxels = 1.5;
/// Points of the new surface that are aligned.
constexpr std::size_t kAlignPoints = 600;

}  // namespace

bool ObjectTracker::may_tell(const Motion& motion, const Departure& departure,
                             const LibraryObject& found, StampNs now_ns) const {
  // What came from farther away is told once nearer origins had time to show.
  const auto wait_ns = static_cast<StampNs>(kFarWaitS * 1e9);
  const double moved_m = motion.lengths * longest_side(departure.box);
  return motion.lengths <= kAtOnceShare ||
         moved_m <= kAtOnceReachShare * config_.state.relocation_reach_m ||
         (now_ns - departure.departed_ns >= wait_ns && now_ns - found.first_seen_ns >= wait_ns);
}

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

std::optional<Motion> ObjectTracker::motion_of(const Step& step, const Departure& departure,
                                               const LibraryObject& found) const {
  if (departure.class_id != found.class_id || departure.id == found.id) return std::nullopt;
  // What was seen in its place when the new one was there, too, is another thing.
  if (departure.in_place_ns > found.first_seen_ns) return std::nullopt;
  const double slack_m = 3.0 * config_.map.voxel_size_m;
  const double distance_m =
      (departure.box.pose.position_W - found.box.pose.position_W).head<2>().norm();
  // Of each only a part may be known: how far it went is told by the alignment.
  const double parts_m =
      0.5 * (departure.box.size_m.head<2>().norm() + found.box.size_m.head<2>().norm());
  if (distance_m > config_.state.relocation_reach_m + parts_m) return std::nullopt;
  if (!stands_as_high(found.box, departure.box, slack_m)) return std::nullopt;
  // Of a thing with a class only a part may have been known; without one, what is larger is
  // another.
  if (found.class_id == kThing && is_larger(found.box, departure.box, slack_m)) return std::nullopt;

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
  std::vector<Motion> explanations;
  for (const Pose& start : starts) {
    const IcpResult icp = point_to_plane_icp(target, source, options, start);
    if (icp.dissimilarity > kUnseenShare) continue;
    if (const auto motion = explanation(step, departure, found, target, source, icp))
      explanations.push_back(*motion);
  }
  const auto best = std::max_element(
      explanations.begin(), explanations.end(),
      [](const Motion& a, const Motion& b) { return a.likelihood() < b.likelihood(); });
  // It must be seen well enough; a worse one is no answer until then.
  if (best == explanations.end() || best->seen < kSeenShare) return std::nullopt;
  if (best->seen >= kWholeShare) return *best;
  if (found.arrival != Arrival::kArrived &&
      (!best->fits_surely || Eigen::AngleAxisd(best->T_new_old.linear()).angle() > kShiftRad)) {
    return std::nullopt;
  }
  // Of a small part of a flat face nobody can tell how far it slid.
  const auto centre_of = [&](const Motion& motion) -> Eigen::Vector3d {
    return motion.T_new_old * departure.box.pose.position_W;
  };
  for (const Motion& other : explanations) {
    if (other.fit > best->fit - kSameFit &&
        (centre_of(other) - centre_of(*best)).norm() > kSlideShare * longest_side(departure.box))
      return std::nullopt;
  }
  return *best;
}

bool ObjectTracker::origin_in_doubt(const LibraryObject& object) {
  for (const ObjectId id :
       library_.near(object.box.pose.position_W, config_.state.relocation_reach_m)) {
    const LibraryObject* other = library_.find(id);
    if (other->confirmed && other->class_id == object.class_id &&
        (other->looks_displaced > 0 ||
         (other->looks_unobserved > 0 && other->in_place_ns <= object.first_seen_ns))) {
      return true;
    }
  }
  return false;
}

LibraryObject* ObjectTracker::find_departed(const Step& step, const Departure& departure,
                                            Motion& motion) {
  LibraryObject* best = nullptr;
  const StampNs now_ns = step.frame.stamp_ns;
  const auto window_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  for (const ObjectId id :
       library_.near(departure.box.pose.position_W,
                     config_.state.relocation_reach_m + departure.box.size_m.head<2>().norm())) {
    LibraryObject* other = library_.find(id);
    const bool open = other->confirmed ? other->added_ns && now_ns - *other->added_ns <= window_ns
                                       : other->observations >= 2;
    if (!open || other->id == departure.part_of) continue;
    const auto m = motion_of(step, departure, *other);
    if (!m || (best && m->likelihood() <= motion.likelihood())) continue;
    best = other, motion = *m;
  }
  return best && may_tell(motion, departure, *best, now_ns) ? best : nullptr;
}

void ObjectTracker::depart(Step& step, Departure departure, Rule rule) {
  departure.evidence.rule = rule_text(rule);
  const auto moves =
      departures_.recent_moves(step.frame.stamp_ns, config_.state.relocation_window_s);
  for (auto move = moves.rbegin(); move != moves.rend(); ++move) {
    const Along along = went_along(step, departure, *move);
    if (along == Along::kNo) continue;
    if (along == Along::kJoined && departure.part_of == ObjectId::kNone)
      step.result.retired.push_back(departure.id);
    return;
  }
  Motion motion;
  if (LibraryObject* found = find_departed(step, departure, motion)) {
    report_move(step, *found, departure, motion.T_new_old, rule);
    return;
  }
  ObjectEvent event;
  event.sequence = next_event_++;
  event.kind = EventKind::kRemoved;
  event.object = departure.id;
  event.class_id = departure.class_id;
  event.stamp_ns = step.frame.stamp_ns;
  event.frame_sequence = step.frame.sequence;
  event.robot = step.frame.robot;
  event.box = departure.box;
  event.evidence = departure.evidence;
  event.last_there_ns = departure.in_place_ns;
  event.first_gone_ns = departure.first_gone_ns;
  step.result.events.push_back(std::move(event));
  if (departure.part_of == ObjectId::kNone) step.result.retired.push_back(departure.id);
  keep(std::move(departure), step.result);
}

void ObjectTracker::keep(Departure departure, FrameResult& result) {
  if (departures_.add(std::move(departure))) return;
  result.warnings.push_back("more than " + std::to_string(Departures::kMost) +
                            " things departed within state.relocation_window_s: the oldest would "
                            "be a new thing where it is found again");
}

void ObjectTracker::keep(const Move& move, FrameResult& result) {
  if (departures_.add_move(move)) return;
  result.warnings.push_back("more than " + std::to_string(Departures::kMost) +
                            " things moved within state.relocation_window_s: a side of the oldest "
                            "would be a thing of its own");
}

bool ObjectTracker::find_origin(Step& step, LibraryObject& object) {
  const Departure* best = nullptr;
  Motion motion;
  for (const Departure& d :
       departures_.recent(step.frame.stamp_ns, config_.state.relocation_window_s)) {
    const auto m = motion_of(step, d, object);
    if (!m || (best && m->likelihood() <= motion.likelihood())) continue;
    best = &d, motion = *m;
  }
  if (!best || !may_tell(motion, *best, object, step.frame.stamp_ns)) return false;
  const Departure from = *best;
  report_move(step, object, from, motion.T_new_old, Rule::kFoundAgain);
  return true;
}

void ObjectTracker::find_far_moves(Step& step) {
  const StampNs now_ns = step.frame.stamp_ns;
  const auto wait_ns = static_cast<StampNs>(kFarWaitS * 1e9);
  std::vector<Departure> due;
  for (const Departure& d : departures_.recent(now_ns, config_.state.relocation_window_s)) {
    if (!d.asked_far && now_ns - d.departed_ns >= wait_ns) due.push_back(d);
  }
  for (const Departure& d : due) {
    departures_.set_asked_far(d.id);
    Motion motion;
    if (LibraryObject* found = find_departed(step, d, motion))
      report_move(step, *found, d, motion.T_new_old, Rule::kFoundAgain);
  }
  while (!arrivals_.empty()) {
    LibraryObject* object = library_.find(arrivals_.front());
    const bool open = object && object->added_ns;  // else it went, or moved, or is of another one
    if (open && now_ns - *object->added_ns < wait_ns) break;
    arrivals_.pop_front();
    if (open) find_origin(step, *object);
  }
}

void ObjectTracker::confirm(Step& step, LibraryObject& object) {
  if (find_origin(step, object)) return;
  object.confirmed = true;
  object.reported_box = object.box;
  object.lost = 0;
  object.added_ns = step.frame.stamp_ns;
  arrivals_.push_back(object.id);
  hide_space_behind(step, object, 0);
  mark_changed(object);
  add_event(step, EventKind::kAdded, object, added_rule(object.arrival));
}

void ObjectTracker::report_move(Step& step, LibraryObject& found, const Departure& from,
                                const Pose& T_new_old, Rule rule) {
  const std::optional<ObjectId> absorbed =
      found.confirmed ? std::make_optional(found.id) : std::nullopt;
  const ObjectId old = found.id;
  departures_.forget(from.id);
  if (absorbed) step.result.retired.push_back(*absorbed);
  step.edits.reassign(old, from.id);
  std::replace(step.owners.begin(), step.owners.end(), old, from.id);
  library_.rename(old, from.id);
  auto& retired = step.result.retired;
  retired.erase(std::remove(retired.begin(), retired.end(), from.id), retired.end());
  // Its other sides went with it, but for those whose place was seen empty.
  std::vector<Surfel> sides = moved_surfels(from.surfels, T_new_old);
  sides.erase(
      std::remove_if(sides.begin(), sides.end(),
                     [&](const Surfel& s) { return seen_empty(step.distance_at, s.point_W); }),
      sides.end());
  hide_space_behind(step, found, 0);
  found.model.add(sides);
  found.icp_target.reset();
  found.most_surfels = found.model.surfels().size();
  refit_box(step, found);
  found.first_seen_ns = from.first_seen_ns;
  for (const std::string& robot : from.seen_by) found.note_seer(robot);
  found.confirmed = true;
  found.arrival = Arrival::kArrived;
  found.moved = true;
  found.placed_ns = step.frame.stamp_ns;
  found.added_ns.reset();
  found.reported_box = found.box;
  found.lost = 0;
  found.changed = false;  // it was listed under its old id
  mark_changed(found);
  Move move;
  move.id = found.id;
  move.class_id = found.class_id;
  move.T_new_old = T_new_old;
  move.in_place_ns = from.in_place_ns;
  move.moved_ns = step.frame.stamp_ns;
  ObjectEvent& event = add_event(step, EventKind::kMoved, found, rule);
  // Where all that is known of it was; of what departed, only a part may have been known.
  OrientedBox before = found.box;
  before.pose.position_W = T_new_old.inverse() * before.pose.position_W;
  const Eigen::Matrix3d& R = T_new_old.linear();
  before.pose.yaw_rad -= std::atan2(R(1, 0), R(0, 0));
  event.previous_box = before;
  event.absorbed = absorbed;
  event.evidence = from.evidence;
  event.evidence.rule = rule_text(rule);
  event.last_there_ns = from.in_place_ns;
  event.first_gone_ns = from.first_gone_ns;
  move.from = before;
  step.moves.push_back(move);
  keep(move, step.result);
}

}  // namespace pocd
