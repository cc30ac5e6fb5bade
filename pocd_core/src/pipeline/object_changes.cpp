// ObjectTracker: joining, confirming, moving and removing objects, and the events about it.
#include <algorithm>
#include <cmath>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// Two objects share an observation when this share of the visible points of each lies on it, and
/// at least so many of them.
constexpr double kSharedShare = 0.5;
constexpr int kSharedPoints = 10;
/// An object measured so short a time ago is in its place.
constexpr StampNs kInPlaceNs = 2'000'000'000;
/// An object that turned up did so on a later drive than the one on which another was last seen if
/// the time between is this many times what has passed since.
constexpr StampNs kSameDrive = 3;
/// A known object slid along itself when it lost and gained at least this share of its points.
constexpr double kSlidShare = 0.12;

}  // namespace

void ObjectTracker::join_companions(Step& step) {
  // Two objects whose visible points mostly lie on one observation are one thing seen from two
  // ends.
  for (const Match& match : step.association.matches) {
    if (!match.stationary) continue;
    LibraryObject& kept = *candidates_[match.candidate].object;
    for (std::size_t c = 0; c < step.candidate_count; ++c) {
      LibraryObject& other = *candidates_[c].object;
      if (other.id == kept.id || other.class_id != kept.class_id) continue;
      const Sighting& s = candidates_[c].sighting;
      const auto touch = std::find_if(s.touches.begin(), s.touches.end(), [&](const auto& t) {
        return t.observation == match.observation;
      });
      if (touch == s.touches.end() || touch->hit < kSharedPoints ||
          touch->hit <= kSharedShare * s.visible())
        continue;
      ++kept.companions[other.id];
    }
  }
  std::vector<std::pair<ObjectId, ObjectId>> joined;  // survivor, absorbed
  for (std::size_t c = 0; c < step.candidate_count; ++c) {
    for (const auto& [other, frames] : candidates_[c].object->companions) {
      if (frames >= config_.state.merge_frames) {
        const ObjectId a = candidates_[c].object->id;
        joined.emplace_back(std::min(a, other), std::max(a, other));
      }
    }
  }
  for (const auto& [survivor_id, absorbed_id] : joined) {
    LibraryObject* survivor = library_.find(survivor_id);
    LibraryObject* absorbed = library_.find(absorbed_id);
    if (!survivor || !absorbed) continue;
    survivor->model.absorb(absorbed->model);
    survivor->icp_target.reset();
    survivor->most_surfels = std::max(survivor->most_surfels, survivor->model.surfels().size());
    survivor->observations += absorbed->observations;
    survivor->companions.clear();
    mark_changed(*survivor);
    step.map.reassign_object(absorbed_id, survivor_id);
    for (auto& owner : step.owner_of_observation) {
      if (owner == to_index(absorbed_id)) owner = to_index(survivor_id);
    }
    const bool was_known = absorbed->confirmed;
    library_.erase(absorbed_id);
    refit_box(step, *survivor);
    if (was_known) {
      step.result.retired.push_back(absorbed_id);
      if (!survivor->confirmed) confirm(step, *survivor);
      add_event(step, EventKind::kUpdated, *survivor,
                "joined_" + std::to_string(to_index(absorbed_id)));
      survivor->reported_box = survivor->box;
    }
  }
}

void ObjectTracker::mark_changed(LibraryObject& object) {
  if (!object.changed) changed_.push_back(object.id);
  object.changed = true;
}

ObjectEvent& ObjectTracker::add_event(Step& step, EventKind kind, const LibraryObject& object,
                                      const std::string& rule) {
  ObjectEvent event;
  event.sequence = next_event_++;
  event.kind = kind;
  event.object = object.id;
  event.class_id = object.class_id;
  event.stamp_ns = step.frame.stamp_ns;
  event.frame_sequence = step.frame.sequence;
  event.robot = step.frame.robot;
  event.box = object.box;
  const auto it = step.evidence.find(object.id);
  if (it != step.evidence.end()) {
    event.evidence = it->second;
  } else {
    event.evidence.stationarity_class = object.stationarity_class;
    event.evidence.before = event.evidence.after = object.belief;
  }
  event.evidence.rule = rule;
  step.result.events.push_back(std::move(event));
  return step.result.events.back();
}

void ObjectTracker::confirm(Step& step, LibraryObject& object) {
  object.confirmed = true;
  object.reported_box = object.box;
  object.gained = object.lost = 0;
  const RelocationMemory::Removed* removed = removed_like(step, object);
  const bool whole = removed && alike(removed->box, object.box, like_size_slack_m());
  if (!removed || !(whole || object.growing)) {
    mark_changed(object);
    add_event(step, EventKind::kAdded, object, "confirmed");
    object.added_ns = step.frame.stamp_ns;
    return;
  }
  const OrientedBox previous_box = removed->box;
  const ObjectId id = removed->id;
  const StampNs first_seen_ns = removed->first_seen_ns;
  relocations_.forget(id);
  take_identity(step, object, id, first_seen_ns);
  add_event(step, EventKind::kMoved, object, "found_again").previous_box = previous_box;
}

const RelocationMemory::Removed* ObjectTracker::removed_like(const Step& step,
                                                             const LibraryObject& object) {
  const RelocationMemory::Removed* removed = relocations_.find(
      object.class_id, object.box, step.frame.stamp_ns, config_.state.relocation_window_s,
      config_.state.relocation_reach_m, like_size_slack_m());
  return removed && !has_nearer_claim(step, object, removed->id, removed->box) ? removed : nullptr;
}

bool ObjectTracker::has_nearer_claim(const Step& step, const LibraryObject& found,
                                     ObjectId claimant, const OrientedBox& old_place) const {
  const Eigen::Vector3d& here_W = found.box.pose.position_W;
  const double distance = (old_place.pose.position_W - here_W).head<2>().norm();
  return library_.any_near(here_W, distance, [&](const LibraryObject& other) {
    const bool unseen = step.frame.stamp_ns - other.last_seen_ns > kInPlaceNs;
    return other.id != claimant && other.id != found.id && other.confirmed && unseen &&
           other.class_id == found.class_id && other.first_seen_ns < found.first_seen_ns &&
           (other.box.pose.position_W - here_W).head<2>().norm() < distance;
  });
}

void ObjectTracker::take_identity(Step& step, LibraryObject& object, ObjectId id,
                                  StampNs first_seen_ns) {
  const ObjectId old = object.id;
  step.map.reassign_object(old, id);
  for (auto& owner : step.owner_of_observation) {
    if (owner == to_index(old)) owner = to_index(id);
  }
  if (const auto it = step.evidence.find(old); it != step.evidence.end())
    step.evidence[id] = it->second;
  library_.rename(old, id);
  object.first_seen_ns = first_seen_ns;
  object.changed = false;  // it was listed under its old id
  auto& retired = step.result.retired;
  retired.erase(std::remove(retired.begin(), retired.end(), id), retired.end());
  mark_changed(object);
}

LibraryObject* ObjectTracker::added_like(const Step& step, const LibraryObject& object) {
  LibraryObject* best = nullptr;
  double best_distance = 0.0;
  const auto window_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  const double reach_m = config_.state.relocation_reach_m;
  for (const ObjectId id : library_.near(object.box.pose.position_W, reach_m)) {
    LibraryObject* other = library_.find(id);
    if (other == &object || !other->added_ns ||
        step.frame.stamp_ns - *other->added_ns > window_ns || other->class_id != object.class_id ||
        !may_be(*other, object)) {
      continue;
    }
    // What was found on the same drive as the object itself is not where it went.
    const StampNs between_ns = other->first_seen_ns - object.last_seen_ns;
    if (between_ns <= kSameDrive * (step.frame.stamp_ns - other->first_seen_ns)) continue;
    const double distance = (other->box.pose.position_W - object.box.pose.position_W).norm();
    if (distance > reach_m || has_nearer_claim(step, *other, object.id, object.box)) continue;
    if (!best || distance < best_distance) best = other, best_distance = distance;
  }
  return best;
}

bool ObjectTracker::may_be(const LibraryObject& found, const LibraryObject& known) const {
  if (alike(found.box, known.box, like_size_slack_m())) return true;
  // What is not seen whole yet may still grow into the size.
  const double distance = (found.box.pose.position_W - known.box.pose.position_W).norm();
  return found.growing && distance <= config_.state.relocation_reach_m &&
         fits_inside(found.box, known.box, like_size_slack_m());
}

LibraryObject* ObjectTracker::new_place_of(const Step& step, const LibraryObject& object) {
  LibraryObject* best = nullptr;
  double best_distance = 0.0;
  for (const ObjectId id : step.in_view) {
    LibraryObject* other = library_.find(id);
    if (!other || other->confirmed || other->class_id != object.class_id ||
        other->observations < 2 || other->last_seen_ns != step.frame.stamp_ns) {
      continue;
    }
    const double distance = (other->box.pose.position_W - object.box.pose.position_W).norm();
    if (!may_be(*other, object) || has_nearer_claim(step, *other, object.id, object.box)) continue;
    const bool named = other->moved_from == object.id,
               best_named = best && best->moved_from == object.id;
    if (!best || (named && !best_named) || (named == best_named && distance < best_distance)) {
      best = other;
      best_distance = distance;
    }
  }
  return best;
}

void ObjectTracker::remove(Step& step, ObjectId id, const std::string& rule) {
  LibraryObject& object = *library_.find(id);
  LibraryObject* successor = object.confirmed ? new_place_of(step, object) : nullptr;
  // It may have been seen at its new place before the old one was seen empty.
  if (object.confirmed && !successor) successor = added_like(step, object);
  if (successor && successor->confirmed) step.result.retired.push_back(successor->id);
  if (object.confirmed && !successor) {
    add_event(step, EventKind::kRemoved, object, rule);
    step.result.retired.push_back(id);
    relocations_.remember(
        {id, object.class_id, object.box, object.first_seen_ns, step.frame.stamp_ns});
  }
  step.map.clear_object(id);
  for (auto& owner : step.owner_of_observation) {
    if (owner == to_index(id)) owner = IntegrationInput::kSkip;
  }
  const OrientedBox previous_box = object.box;
  const StampNs first_seen_ns = object.first_seen_ns;
  library_.erase(id);
  if (!successor) return;
  const Evidence evidence = step.evidence[id];
  take_identity(step, *successor, id, first_seen_ns);
  successor->confirmed = true;
  successor->added_ns.reset();
  successor->reported_box = successor->box;
  successor->gained = successor->lost = 0;
  step.evidence[id] = evidence;
  add_event(step, EventKind::kMoved, *successor, rule).previous_box = previous_box;
}

void ObjectTracker::remove_or_confirm(Step& step) {
  std::vector<std::pair<ObjectId, std::string>> to_remove;
  for (const ObjectId id : step.in_view) {
    const LibraryObject* object = library_.find(id);  // gone if joined with another
    if (!object) continue;
    if (const auto rule = removal_rule(*object, config_.state, config_.change))
      to_remove.emplace_back(id, *rule);
  }
  for (const auto& [id, rule] : to_remove) {
    if (library_.find(id)) remove(step, id, rule);
  }

  const auto needed = static_cast<std::uint32_t>(config_.state.confirm_observations);
  const auto wait = static_cast<std::uint32_t>(config_.state.wait_for_doubt_frames);
  std::vector<LibraryObject*> ready;
  for (const auto owner : step.owner_of_observation) {
    LibraryObject* object =
        owner == IntegrationInput::kSkip ? nullptr : library_.find(ObjectId{owner});
    if (!object || object->confirmed || object->observations < needed) continue;
    if (std::find(ready.begin(), ready.end(), object) == ready.end()) ready.push_back(object);
  }
  std::sort(ready.begin(), ready.end(), [](const auto* a, const auto* b) { return a->id < b->id; });
  for (LibraryObject* object : ready) {
    bool doubt = false;
    for (const ObjectId id : step.in_view) {
      const LibraryObject* other = library_.find(id);
      if (!other || other == object || !other->confirmed || other->class_id != object->class_id)
        continue;
      doubt =
          doubt || object->moved_from == id ||
          (other->frames_seen_through > 0 && alike(other->box, object->box, like_size_slack_m()));
    }
    // A removed object seen again from the side grows into its old size within a few frames.
    doubt = doubt || (object->growing && removed_like(step, *object) != nullptr);
    if (doubt && object->observations < needed + wait) continue;
    confirm(step, *object);
  }
}

void ObjectTracker::report_changes(Step& step) {
  std::sort(changed_.begin(), changed_.end());
  std::vector<LibraryObject*> touched;
  for (const ObjectId id : changed_) {
    LibraryObject* object = library_.find(id);  // null when removed since
    if (!object) continue;
    object->changed = false;
    if (object->confirmed) touched.push_back(object);
  }
  changed_.clear();
  for (LibraryObject* object : touched) {
    const double shift_m =
        (object->box.pose.position_W - object->reported_box.pose.position_W).norm();
    const double growth = (object->box.size_m - object->reported_box.size_m).cwiseAbs().maxCoeff();
    const double notable_m = std::max(config_.change.tau_m, 2.0 * config_.map.voxel_size_m);
    // Lost points at one end and gained as many at the other: it slid along itself.
    const double least = kSlidShare * static_cast<double>(object->model.surfels().size());
    if (static_cast<double>(object->lost) > least && static_cast<double>(object->gained) > least &&
        shift_m > notable_m && growth < notable_m) {
      ObjectEvent& event = add_event(step, EventKind::kMoved, *object, "slid");
      event.previous_box = object->reported_box;
    } else if (shift_m > notable_m || growth > notable_m) {
      add_event(step, EventKind::kUpdated, *object,
                object->lost > object->gained ? "part_removed" : "grew");
    } else {
      continue;
    }
    object->reported_box = object->box;
    object->gained = object->lost = 0;
  }
  for (const LibraryObject* object : touched)
    step.result.changed_objects.push_back(snapshot(*object));
  std::sort(step.result.retired.begin(), step.result.retired.end());
}

}  // namespace pocd
