// ObjectTracker: whether what is said to have moved is the thing that departed, asked again as more
// of it is seen.
#include <algorithm>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// It is asked again when so many times the surface is known at the new place.
constexpr double kAskAgain = 1.3;
/// It is another thing only when so much was measured at the new place, as a share of the surface
/// that departed.
constexpr double kRefuteShare = 0.6;

}  // namespace

void ObjectTracker::ask_moves_again(Step& step, const std::vector<ObjectId>& touched) {
  for (const ObjectId id : touched) {
    LibraryObject* object = library_.find(id);
    Move* move = object && object->moved ? departures_.last_move_of(id) : nullptr;
    if (!move || !move->left || move->moved_ns == step.frame.stamp_ns) continue;
    std::vector<Surfel> there;
    for (const Surfel& s : object->model.surfels()) {
      if (s.last_hit_ns >= move->first_seen_there_ns) there.push_back(s);
    }
    if (static_cast<double>(there.size()) < kAskAgain * static_cast<double>(move->surfels_there))
      continue;
    move->surfels_there = there.size();
    LibraryObject found(ObjectId::kNone, config_.map.voxel_size_m);
    found.class_id = object->class_id;
    found.observations = object->observations;
    found.first_seen_ns = move->first_seen_there_ns;
    found.model.add(there);
    found.arrival = arrival_of(found);
    const auto box = fit(step, found);
    if (!box) continue;
    found.box = *box;
    const std::vector<Motion> motions = motions_of(step, *move->left, found, Asked::kAgain);
    if (const auto motion = likeliest(motions, *move->left, found.arrival)) {
      correct(step, *object, found.model, *move, motion->T_new_old);
    } else if (motions.empty() &&
               static_cast<double>(there.size()) >=
                   kRefuteShare * static_cast<double>(move->left->surfels.size())) {
      take_back(step, *object, found);
    }
  }
}

void ObjectTracker::correct(Step& step, LibraryObject& object, const ObjectModel& there, Move& move,
                            const Pose& T_new_old) {
  const Eigen::Vector3d middle_W = move.left->box.pose.position_W;
  if ((T_new_old * middle_W - move.T_new_old * middle_W).norm() < config_.change.tau_m) return;
  object.model = there;
  object.model.add(other_sides(step, *move.left, T_new_old));
  object.icp_target.reset();
  object.most_surfels = object.model.surfels().size();
  forget_sights(step, object);
  refit_box(step, object);
  mark_changed(object);
  add_event(step, EventKind::kUpdated, object, Rule::kGrew);
  object.reported_box = object.box;
  move.T_new_old = T_new_old;
  move.from = box_before(object.box, T_new_old);
  step.moves.push_back(move);
}

void ObjectTracker::take_back(Step& step, LibraryObject& object, const LibraryObject& there) {
  Departure left = *departures_.last_move_of(object.id)->left;
  departures_.forget_moves_of(object.id);
  const ObjectId id = library_.reserve_id();
  left.is_not = id;
  step.edits.reassign(object.id, id);
  std::replace(step.owners.begin(), step.owners.end(), object.id, id);
  library_.rename(object.id, id);
  object.model = there.model;
  object.icp_target.reset();
  object.most_surfels = object.model.surfels().size();
  forget_sights(step, object);
  object.first_seen_ns = there.first_seen_ns;
  object.arrival = there.arrival;
  object.moved = false;
  object.changed = false;  // it was listed under its old id
  refit_box(step, object);
  report_gone(step, left, Rule::kAnotherThing);
  // A part that moved was an object of its own.
  if (left.part_of != ObjectId::kNone) step.result.retired.push_back(left.id);
  confirm(step, object);
}

}  // namespace pocd
