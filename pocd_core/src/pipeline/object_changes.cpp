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
/// The same share of all its points, and at most this many times as many against it.
constexpr double kSharedTotal = 0.2;
constexpr double kSharedOdd = 0.2;
/// A part of something waits so many times longer for the rest to be seen.
constexpr std::uint32_t kPartPatience = 4;
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
      // What only touches at an edge, or lies in front, is another thing.
      if (touch == s.touches.end() || touch->hit < kSharedPoints ||
          touch->hit < kSharedTotal * s.total || touch->hit <= kSharedShare * s.visible() ||
          s.seen_through + touch->in_front > kSharedOdd * touch->hit)
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
    // What is known outside goes on; of two such, the older one.
    if (absorbed->confirmed && !survivor->confirmed) std::swap(survivor, absorbed);
    absorb(step, *survivor, *absorbed);
  }
}

void ObjectTracker::absorb(Step& step, LibraryObject& survivor, LibraryObject& absorbed) {
  const ObjectId absorbed_id = absorbed.id;
  const bool was_known = absorbed.confirmed;
  survivor.model.absorb(absorbed.model);
  survivor.icp_target.reset();
  survivor.most_surfels = std::max(survivor.most_surfels, survivor.model.surfels().size());
  survivor.observations += absorbed.observations;
  survivor.seen_by.insert(absorbed.seen_by.begin(), absorbed.seen_by.end());
  survivor.verified_ns = std::max(survivor.verified_ns, absorbed.verified_ns);
  survivor.last_seen_ns = std::max(survivor.last_seen_ns, absorbed.last_seen_ns);
  survivor.companions.clear();
  mark_changed(survivor);
  step.map.reassign_object(absorbed_id, survivor.id);
  for (auto& owner : step.owner_of_observation) {
    if (owner == to_index(absorbed_id)) owner = to_index(survivor.id);
  }
  library_.erase(absorbed_id);
  refit_box(step, survivor);
  if (!was_known) return;
  step.result.retired.push_back(absorbed_id);
  add_event(step, EventKind::kUpdated, survivor, "joined_" + std::to_string(to_index(absorbed_id)))
      .absorbed = absorbed_id;
  survivor.reported_box = survivor.box;
}

void ObjectTracker::mark_changed(LibraryObject& object) {
  if (!object.changed) changed_.push_back(object.id);
  object.changed = true;
}

Evidence ObjectTracker::evidence_of(const Step& step, const LibraryObject& object) {
  const auto it = step.evidence.find(object.id);
  if (it != step.evidence.end()) return it->second;
  Evidence evidence;
  evidence.stationarity_class = object.stationarity_class;
  evidence.before = evidence.after = object.belief;
  return evidence;
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
  event.evidence = evidence_of(step, object);
  event.evidence.rule = rule;
  step.result.events.push_back(std::move(event));
  return step.result.events.back();
}

void ObjectTracker::confirm(Step& step, LibraryObject& object) {
  const auto origin = origin_of(step, object);
  if (origin && origin->removed) {
    report_move(step, object, *origin->removed, "found_again");
    return;
  }
  object.confirmed = true;
  object.reported_box = object.box;
  object.gained = object.eroded = object.returned = 0;
  object.added_ns = step.frame.stamp_ns;
  mark_changed(object);
  add_event(step, EventKind::kAdded, object, "confirmed");
}

void ObjectTracker::report_move(Step& step, LibraryObject& found,
                                const RelocationMemory::Removed& origin, const std::string& rule) {
  const RelocationMemory::Removed from = origin;  // the memory may forget it on the way
  relocations_.forget(from.id);
  const std::optional<ObjectId> absorbed =
      found.confirmed ? std::make_optional(found.id) : std::nullopt;
  if (absorbed) step.result.retired.push_back(*absorbed);
  take_identity(step, found, from.id, from.first_seen_ns, from.seen_by);
  found.confirmed = true;
  found.added_ns.reset();
  found.reported_box = found.box;
  found.gained = found.eroded = found.returned = 0;
  ObjectEvent& event = add_event(step, EventKind::kMoved, found, rule);
  event.previous_box = from.box;
  event.absorbed = absorbed;
  found.expected_box = completed_box(found.box, from.box, step.cloud.T_W_C.translation(),
                                     config_.state.least_depth_m);
  if (found.cut) event.box = found.expected_box;
}

bool ObjectTracker::notable_change(const LibraryObject& object) const {
  const double notable_m = std::max(config_.change.tau_m, 2.0 * config_.map.voxel_size_m);
  const OrientedBox &now = object.box, &then = object.reported_box;
  return (now.pose.position_W - then.pose.position_W).norm() > notable_m ||
         (now.size_m - then.size_m).cwiseAbs().maxCoeff() > notable_m;
}

void ObjectTracker::take_identity(Step& step, LibraryObject& object, ObjectId id,
                                  StampNs first_seen_ns, const std::set<std::string>& seen_by) {
  const ObjectId old = object.id;
  step.map.reassign_object(old, id);
  for (auto& owner : step.owner_of_observation) {
    if (owner == to_index(old)) owner = to_index(id);
  }
  if (const auto it = step.evidence.find(old); it != step.evidence.end())
    step.evidence[id] = it->second;
  library_.rename(old, id);
  object.first_seen_ns = first_seen_ns;
  object.seen_by.insert(seen_by.begin(), seen_by.end());
  object.changed = false;  // it was listed under its old id
  auto& retired = step.result.retired;
  retired.erase(std::remove(retired.begin(), retired.end(), id), retired.end());
  mark_changed(object);
}

void ObjectTracker::remove(Step& step, ObjectId id, const std::string& rule,
                           LibraryObject* successor) {
  LibraryObject& object = *library_.find(id);
  if (object.confirmed && !successor) successor = new_place_of(step, object);
  const RelocationMemory::Removed record{id,
                                         object.class_id,
                                         known_box(object),
                                         object.first_seen_ns,
                                         object.verified_ns,
                                         object.contested_since_ns,
                                         step.frame.stamp_ns,
                                         object.seen_by};
  if (object.confirmed && !successor) {
    add_event(step, EventKind::kRemoved, object, rule);
    step.result.retired.push_back(id);
    relocations_.remember(record);
  }
  const Evidence evidence = evidence_of(step, object);
  step.map.clear_object(id);
  for (auto& owner : step.owner_of_observation) {
    if (owner == to_index(id)) owner = IntegrationInput::kSkip;
  }
  library_.erase(id);
  if (!successor) return;
  report_move(step, *successor, record, rule);
  step.result.events.back().evidence = evidence;
  step.result.events.back().evidence.rule = rule;
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
    if (object->confirmed) continue;  // where another one of them went, found on the way
    // Is it a known one that is about to be found gone? A removed one seen again from the side
    // grows into its old size within a few frames.
    if (explain(step, *object)) continue;
    const auto origin = origin_of(step, *object);
    const bool doubt = origin && (origin->live || object->growing);
    LibraryObject* replaced = replaced_by(step, *object);
    if ((doubt || replaced) && object->observations < needed + wait) continue;
    if (object->observations < needed + kPartPatience * wait && may_be_part(step, *object))
      continue;
    if (replaced) remove(step, replaced->id, "replaced");
    confirm(step, *object);
  }
}

void ObjectTracker::report_changes(Step& step) {
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
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
    const bool slid = (static_cast<double>(object->eroded) > least &&
                       static_cast<double>(object->gained) > least && shift_m > notable_m &&
                       growth < notable_m) ||
                      slide(step, *object);
    if (slid) {
      ObjectEvent& event = add_event(step, EventKind::kMoved, *object, "slid");
      event.previous_box = object->reported_box;
    } else if (shift_m > notable_m || growth > notable_m) {
      add_event(step, EventKind::kUpdated, *object,
                object->eroded > object->gained ? "part_removed" : "grew");
    } else {
      continue;
    }
    object->reported_box = object->box;
    // One that may be sliding is asked again with all that it gained and lost.
    if (slid || !object->grew_ns) object->gained = object->eroded = object->returned = 0;
  }
  for (const LibraryObject* object : touched)
    step.result.changed_objects.push_back(snapshot(*object));
  std::sort(step.result.retired.begin(), step.result.retired.end());
}

}  // namespace pocd
