// ObjectTracker: confirming objects, and reporting what changed.
#include <algorithm>

#include "tracker_step.hpp"

namespace pocd {

void ObjectTracker::confirm_objects(Step& step) {
  const auto needed = static_cast<std::uint32_t>(config_.state.confirm_observations);
  const auto wait = static_cast<std::uint32_t>(config_.state.wait_for_doubt_frames);
  std::vector<ObjectId> ready;
  for (const ObjectId id : step.owners) {
    const LibraryObject* object = library_.find(id);
    if (object && !object->confirmed && object->observations >= needed) ready.push_back(id);
  }
  std::sort(ready.begin(), ready.end());
  ready.erase(std::unique(ready.begin(), ready.end()), ready.end());
  for (const ObjectId id : ready) {
    LibraryObject* object = library_.find(id);
    if (!object || object->confirmed) continue;
    if (object->model.surfels().size() < least_surfels()) continue;
    if (object->observations < needed + wait && origin_in_doubt(*object)) continue;
    if (LibraryObject* whole = whole_of(step, *object)) {
      absorb(step, *whole, *object);
      continue;
    }
    // Of what geometry alone tells, a side must have been seen: it may be a piece of a wall.
    if (object->class_id == kThing && object->most_free < config_.segmentation.things.side_share) {
      continue;
    }
    confirm(step, *object);
  }
}

void ObjectTracker::report_changes(Step& step) {
  find_far_moves(step);
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  const double notable_m = std::max(config_.change.tau_m, 2.0 * config_.map.voxel_size_m);
  std::vector<ObjectId> touched;
  for (const ObjectId id : changed_) {
    LibraryObject* object = library_.find(id);  // null when removed since
    if (!object) continue;
    object->changed = false;
    if (object->confirmed) touched.push_back(id);
  }
  changed_.clear();
  for (const ObjectId id : touched) {
    LibraryObject* object = library_.find(id);
    if (!object) continue;  // it has another id now: it is one that departed
    const double shift_m =
        (object->box.pose.position_W - object->reported_box.pose.position_W).norm();
    const double growth_m =
        (object->box.size_m - object->reported_box.size_m).cwiseAbs().maxCoeff();
    if (shift_m <= notable_m && growth_m <= notable_m) continue;
    // Seen better, what was reported as new may turn out to be what departed before.
    if (object->added_ns && find_origin(step, *object)) continue;
    // Or a side of what stands there.
    if (LibraryObject* whole = grown_onto(step, *object)) {
      join(step, *object, *whole);
      continue;
    }
    add_event(step, EventKind::kUpdated, *object,
              object->lost > 0 ? Rule::kPartRemoved : Rule::kGrew);
    object->reported_box = object->box;
    object->lost = 0;
  }
  ask_moves_again(step, touched);
  // Grows while it is worked on.
  for (std::size_t i = 0; i < step.moves.size(); ++i) gather_sides(step, step.moves[i]);
  // Those above, and what was found out about others meanwhile.
  touched.insert(touched.end(), changed_.begin(), changed_.end());
  changed_.clear();
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (const ObjectId id : touched) {
    LibraryObject* object = library_.find(id);
    if (!object || !object->confirmed) continue;
    object->changed = false;
    step.result.changed_objects.push_back(snapshot(*object));
  }
  std::sort(step.result.retired.begin(), step.result.retired.end());
}

}  // namespace pocd
