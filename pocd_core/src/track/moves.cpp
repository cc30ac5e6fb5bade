// ObjectTracker: what departed and what arrived, and whether they are one thing.
#include <algorithm>
#include <cmath>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// So far, in its lengths or in shares of the reach, a move is told at once.
constexpr double kAtOnceShare = 1.0;
constexpr double kAtOnceReachShare = 1.0 / 3.0;
/// A longer one is told after this time: another origin may be nearer [s].
constexpr double kFarWaitS = 1.0;

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
  report_gone(step, std::move(departure), rule);
}

void ObjectTracker::report_gone(Step& step, Departure departure, Rule rule) {
  departure.evidence.rule = rule_text(rule);
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

OrientedBox box_before(const OrientedBox& box, const Pose& T_new_old) {
  OrientedBox before = box;
  before.pose.position_W = T_new_old.inverse() * before.pose.position_W;
  const Eigen::Matrix3d& R = T_new_old.linear();
  before.pose.yaw_rad -= std::atan2(R(1, 0), R(0, 0));
  return before;
}

std::vector<Surfel> ObjectTracker::other_sides(const Step& step, const Departure& departure,
                                               const Pose& T_new_old) const {
  std::vector<Surfel> sides = moved_surfels(departure.surfels, T_new_old);
  sides.erase(
      std::remove_if(sides.begin(), sides.end(),
                     [&](const Surfel& s) { return seen_empty(step.distance_at, s.point_W); }),
      sides.end());
  return sides;
}

void ObjectTracker::move_displaced(Step& step, Look& look) {
  LibraryObject& object = *look.object;
  const OrientedBox previous_box = object.box;
  Move move;
  move.id = object.id;
  move.class_id = object.class_id;
  move.from = previous_box;
  move.T_new_old = look.T_new_old;
  move.in_place_ns = object.in_place_ns;
  move.moved_ns = step.frame.stamp_ns;
  object.looks_displaced = 0;
  object.model.transform(look.T_new_old);
  for (Surfel& s : object.model.surfels()) s.seen_through = 0;
  look.sighting.sights.clear();  // of points that are elsewhere now
  object.icp_target.reset();
  step.edits.clear(object.id);
  refit_box(step, object);
  measure(step, look, look.sign * look.displacement_m);
  // Change is measured from the new place on.
  const auto evidence = step.evidence.find(object.id);
  if (evidence != step.evidence.end()) evidence->second.after.mu = 0.0;
  object.belief.mu = 0.0;
  object.moment = {};
  object.in_place_ns = step.frame.stamp_ns;
  object.added_ns.reset();
  object.arrival = Arrival::kArrived;
  object.moved = true;
  object.placed_ns = step.frame.stamp_ns;
  ObjectEvent& event = add_event(step, EventKind::kMoved, object, Rule::kAlignedElsewhere);
  event.previous_box = previous_box;
  event.last_there_ns = move.in_place_ns;
  object.reported_box = object.box;
  object.lost = 0;
  step.moves.push_back(move);
  keep(move, step.result);
}

void ObjectTracker::report_move(Step& step, LibraryObject& found, const Departure& from,
                                const Pose& T_new_old, Rule rule) {
  const std::optional<ObjectId> absorbed =
      found.confirmed ? std::make_optional(found.id) : std::nullopt;
  const ObjectId old = found.id;
  const StampNs first_seen_there_ns = found.first_seen_ns;
  const std::size_t surfels_there = found.model.surfels().size();
  departures_.forget(from.id);
  if (absorbed) step.result.retired.push_back(*absorbed);
  step.edits.reassign(old, from.id);
  std::replace(step.owners.begin(), step.owners.end(), old, from.id);
  library_.rename(old, from.id);
  auto& retired = step.result.retired;
  retired.erase(std::remove(retired.begin(), retired.end(), from.id), retired.end());
  const std::vector<Surfel> sides = other_sides(step, from, T_new_old);
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
  move.from = box_before(found.box, T_new_old);
  event.previous_box = move.from;
  event.absorbed = absorbed;
  event.evidence = from.evidence;
  event.evidence.rule = rule_text(rule);
  event.last_there_ns = from.in_place_ns;
  event.first_gone_ns = from.first_gone_ns;
  move.left = std::make_shared<const Departure>(from);
  move.first_seen_there_ns = first_seen_there_ns;
  move.surfels_there = surfels_there;
  step.moves.push_back(move);
  keep(move, step.result);
}

}  // namespace pocd
