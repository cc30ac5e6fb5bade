#include "object_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "pocd/change/geometric_change.hpp"

namespace pocd {
namespace {

/// Share of visible points that decides whether an object's place is empty, as in association.
constexpr double kMajority = 0.5;
/// Points of an established object must have been measured in this many frames to bear witness.
constexpr int kEstablishedHits = 2;
/// An object that turned up did so on a later drive than the one on which another was last seen if the
/// time between is this many times what has passed since.
constexpr StampNs kSameDrive = 3;
/// When so large a share of at least so many points is off by more than half the verifying distance, the
/// object is aligned anew; when it lies elsewhere in so many frames in a row, it has moved.
constexpr double kOddShare = 0.25;
constexpr int kShiftPoints = 60;
constexpr int kDisplacedFrames = 3;
/// An observation that adds at least this share of points shows that the object is not seen whole yet.
constexpr double kGrowingShare = 0.03;
/// A known object slid along itself when it lost and gained at least this share of its points.
constexpr double kSlidShare = 0.12;

}  // namespace

struct ObjectTracker::Step {
  const Frame& frame;
  const OrganizedCloud& cloud;
  const DepthField& field;
  const Observations& observations;
  const GroundModel& ground;
  TsdfMap& map;
  std::vector<std::uint32_t>& owner_of_observation;
  FrameResult& result;
  std::size_t candidate_count = 0;
  std::vector<ObjectId> in_view;
  AssociationResult association;
  /// Evidence of this frame's measurement, by object.
  std::map<ObjectId, Evidence> evidence;
  /// Observations that look like an object that has moved.
  std::map<std::int32_t, ObjectId> moved_from;
};

void ObjectTracker::update(const Frame& frame, const OrganizedCloud& cloud, const DepthField& field,
                           const Observations& observations, const GroundModel& ground, TsdfMap& map,
                           std::vector<std::uint32_t>& owner_of_observation, FrameResult& result) {
  owner_of_observation.assign(observations.list.size(), IntegrationInput::kSkip);
  Step step{frame, cloud, field, observations, ground, map, owner_of_observation, result, 0, {}, {}, {}, {}};
  find_candidates(step);
  step.association =
      associate(candidates_.data(), step.candidate_count, observations, cloud.T_W_C, config_.association);
  update_matched(step);
  update_unmatched(step);
  erode(step);
  add_new(step);
  join_companions(step);
  remove_or_confirm(step);
  report_changes(step);
}

void ObjectTracker::find_candidates(Step& step) {
  const double reach = config_.map.max_depth_m;
  // The frustum lies within a ball around the point half way to its far end.
  const Eigen::Vector3d axis_W = step.cloud.T_W_C.linear().col(2);
  const double half_width = step.cloud.width / step.cloud.camera.fx / 2.0;
  const double radius = reach * std::hypot(0.5, half_width);
  const Eigen::Vector3d center_W = step.cloud.T_W_C.translation() + 0.5 * reach * axis_W;
  const SightConfig sight{0.5 * config_.change.tau_m, config_.change.pose_tolerance_m, reach};
  for (const ObjectId id : library_.near(center_W, radius)) {
    LibraryObject& object = *library_.find(id);
    if (candidates_.size() <= step.candidate_count) candidates_.emplace_back();
    Candidate& candidate = candidates_[step.candidate_count];
    candidate.object = &object;
    const int min_hits = object.observations > 2 ? kEstablishedHits : 1;
    sight_object(object.model, object.class_id, min_hits, step.cloud, step.field, step.observations, sight,
                 config_.depth_noise, candidate.sighting);
    const Sighting& s = candidate.sighting;
    if (s.hit + s.seen_through + s.occluded + s.unknown == 0) continue;
    ++step.candidate_count;
    step.in_view.push_back(id);
  }
}

void ObjectTracker::update_matched(Step& step) {
  const double verified_m = 0.5 * config_.change.tau_m;
  for (const Match& match : step.association.matches) {
    LibraryObject& object = *candidates_[match.candidate].object;
    const Sighting& sighting = candidates_[match.candidate].sighting;
    const Observation& observation = step.observations.list[match.observation];
    object.frames_seen_through = 0;
    ++object.frames_in_view;
    if (match.stationary && object.confirmed && shift_object(step, object, match, sighting)) continue;
    const double delta_m =
        geometric_change(object, observation, sighting, match, step.cloud, config_.change);
    step.evidence[object.id] = apply_measurement(object, delta_m, sighting, config_.state, config_.change);
    mark_changed(object);
    if (match.displacement_m <= verified_m && std::abs(delta_m) <= verified_m) {
      fuse(step, object, match.observation);
      step.owner_of_observation[match.observation] = to_index(object.id);
    } else if (match.displacement_m > verified_m) {
      // Discarded as evidence of this object; it may be where the object is now.
      step.moved_from[match.observation] = object.id;
      step.association.unassigned.push_back(match.observation);
    }
  }
  for (const auto& piece : step.association.pieces) {
    LibraryObject& object = *candidates_[piece.candidate].object;
    fuse(step, object, piece.observation);
    step.owner_of_observation[piece.observation] = to_index(object.id);
  }
}

bool ObjectTracker::shift_object(Step& step, LibraryObject& object, const Match& match, const Sighting& sighting) {
  const double verified_m = 0.5 * config_.change.tau_m;
  const auto touch = std::find_if(sighting.touches.begin(), sighting.touches.end(),
                                  [&](const auto& t) { return t.observation == match.observation; });
  int odd = touch == sighting.touches.end() ? 0 : touch->in_front;
  const int seen = sighting.visible() + odd;
  for (const float d : sighting.differences_m) {
    if (std::abs(d) > 0.5 * verified_m) ++odd;
  }
  const bool suspicious = seen >= kShiftPoints && odd > kOddShare * seen;
  std::optional<Match> moved;
  if (suspicious) {
    moved = align_in_place(object, step.observations.list[match.observation], step.cloud.T_W_C, config_.association);
  }
  if (!moved || moved->displacement_m < 0.6 * verified_m) {
    object.frames_displaced = 0;
    return false;
  }
  // Not fused: it would smear the model between the two places.
  if (++object.frames_displaced < kDisplacedFrames) return true;
  object.frames_displaced = 0;
  const OrientedBox previous_box = object.box;
  object.model.transform(moved->T_new_old);
  object.icp_target.reset();
  step.map.clear_object(object.id);
  refit_box(step, object);
  mark_changed(object);
  step.evidence[object.id] = apply_measurement(object, moved->sign * moved->displacement_m, sighting,
                                               config_.state, config_.change);
  object.belief.mu = 0.0;  // change is measured from the new place on
  add_event(step, EventKind::kMoved, object, "aligned_elsewhere").previous_box = previous_box;
  object.reported_box = object.box;
  object.gained = object.lost = 0;
  step.owner_of_observation[match.observation] = to_index(object.id);
  return true;
}

void ObjectTracker::update_unmatched(Step& step) {
  std::vector<bool> matched(step.candidate_count, false);
  for (const Match& match : step.association.matches) matched[match.candidate] = true;
  for (std::size_t c = 0; c < step.candidate_count; ++c) {
    if (matched[c]) continue;
    LibraryObject& object = *candidates_[c].object;
    const Sighting& sighting = candidates_[c].sighting;
    if (sighting.visible_share() < config_.association.min_visible_share) continue;
    if (!object.confirmed) ++object.frames_in_view;
    if (!step.association.doubtful[c]) continue;
    ++object.frames_seen_through;
    step.evidence[object.id] =
        apply_measurement(object, config_.change.delta_max_m, sighting, config_.state, config_.change);
    mark_changed(object);
  }
}

void ObjectTracker::erode(Step& step) {
  for (std::size_t c = 0; c < step.candidate_count; ++c) {
    LibraryObject& object = *candidates_[c].object;
    const auto& sights = candidates_[c].sighting.sights;
    auto& surfels = object.model.surfels();
    // Fusion appends; the first ones are still those that were looked at.
    for (std::size_t i = 0; i < sights.size(); ++i) {
      if (sights[i] == Sight::kSeenThrough && surfels[i].seen_through < 255) ++surfels[i].seen_through;
      if (sights[i] == Sight::kHit) surfels[i].seen_through = 0;
    }
    if (const int lost = object.model.erode(config_.state.erode_frames); lost > 0) {
      object.icp_target.reset();
      object.lost += static_cast<std::size_t>(lost);
      mark_changed(object);
      if (!object.model.surfels().empty()) refit_box(step, object);
    }
  }
}

void ObjectTracker::fuse(Step& step, LibraryObject& object, std::int32_t index) {
  const Observation& observation = step.observations.list[index];
  const int added = object.model.fuse(observation.points);
  object.gained += static_cast<std::size_t>(added);
  object.growing = added > kGrowingShare * static_cast<double>(object.model.surfels().size());
  object.icp_target.reset();
  ++object.observations;
  object.last_seen_ns = step.frame.stamp_ns;
  object.last_robot = step.frame.robot;
  mark_changed(object);
  const std::size_t surfels = object.model.surfels().size();
  object.most_surfels = std::max(object.most_surfels, surfels);
  // The box follows the model; refitting for every few points would cost more than it tells.
  const auto difference = std::abs(static_cast<double>(surfels) - static_cast<double>(object.box_surfels));
  if (object.observations < 10 || difference > 0.02 * static_cast<double>(surfels)) refit_box(step, object);
}

void ObjectTracker::refit_box(Step& step, LibraryObject& object) {
  Points points, normals;
  const int min_hits = object.observations > 4 ? kEstablishedHits : 1;
  for (const Surfel& s : object.model.surfels()) {
    if (s.hits < min_hits || s.seen_through >= 3) continue;
    points.push_back(s.point_W);
    normals.push_back(s.normal_W);
  }
  if (points.size() < 3) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p.cast<double>();
  object.centroid_W = sum / static_cast<double>(points.size());
  OrientedBox box = fit_box(points, normals, 0.005);
  // The ground band was cut off: what stands on the ground reaches it.
  if (step.ground.known()) {
    const double ground_m = step.ground.height_at(static_cast<float>(box.pose.position_W.x()),
                                                  static_cast<float>(box.pose.position_W.y()));
    const double bottom = box.pose.position_W.z() - box.size_m.z() / 2;
    const double top = box.pose.position_W.z() + box.size_m.z() / 2;
    if (bottom > ground_m && bottom - ground_m < 2.0 * config_.segmentation.ground_band_m + config_.map.voxel_size_m) {
      box.size_m.z() = top - ground_m;
      box.pose.position_W.z() = 0.5 * (top + ground_m);
    }
  }
  object.box_surfels = object.model.surfels().size();
  library_.place(object, box);
}

void ObjectTracker::add_new(Step& step) {
  auto& indices = step.association.unassigned;
  std::sort(indices.begin(), indices.end());
  for (const std::int32_t index : indices) {
    const Observation& observation = step.observations.list[index];
    LibraryObject& object = library_.create(config_.map.voxel_size_m);
    object.class_id = observation.class_id;
    object.stationarity_class = config_.classes.stationarity_class(observation.class_id);
    object.belief.sigma = config_.state.initial_sigma_m;
    object.belief.alpha = config_.state.initial_stationarity * config_.state.initial_count;
    object.belief.beta = (1.0 - config_.state.initial_stationarity) * config_.state.initial_count;
    object.first_seen_ns = step.frame.stamp_ns;
    const auto origin = step.moved_from.find(index);
    if (origin != step.moved_from.end()) object.moved_from = origin->second;
    fuse(step, object, index);
    object.frames_in_view = 1;
    step.owner_of_observation[index] = to_index(object.id);
  }
}

void ObjectTracker::join_companions(Step& step) {
  // Two objects whose visible points mostly lie on one observation are one thing seen from two ends.
  for (const Match& match : step.association.matches) {
    if (!match.stationary) continue;
    LibraryObject& kept = *candidates_[match.candidate].object;
    for (std::size_t c = 0; c < step.candidate_count; ++c) {
      LibraryObject& other = *candidates_[c].object;
      if (other.id == kept.id || other.class_id != kept.class_id) continue;
      const Sighting& s = candidates_[c].sighting;
      const auto touch = std::find_if(s.touches.begin(), s.touches.end(),
                                      [&](const auto& t) { return t.observation == match.observation; });
      if (touch == s.touches.end() || touch->hit < 10 || touch->hit <= kMajority * s.visible()) continue;
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
      add_event(step, EventKind::kUpdated, *survivor, "joined_" + std::to_string(to_index(absorbed_id)));
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

const RelocationMemory::Removed* ObjectTracker::removed_like(const Step& step, const LibraryObject& object) {
  return relocations_.find(object.class_id, object.box, step.frame.stamp_ns, config_.state.relocation_window_s,
                           config_.state.relocation_reach_m, like_size_slack_m());
}

void ObjectTracker::take_identity(Step& step, LibraryObject& object, ObjectId id, StampNs first_seen_ns) {
  const ObjectId old = object.id;
  step.map.reassign_object(old, id);
  for (auto& owner : step.owner_of_observation) {
    if (owner == to_index(old)) owner = to_index(id);
  }
  if (const auto it = step.evidence.find(old); it != step.evidence.end()) step.evidence[id] = it->second;
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
  for (const ObjectId id : library_.near(object.box.pose.position_W, config_.state.relocation_reach_m)) {
    LibraryObject* other = library_.find(id);
    if (other == &object || !other->added_ns || step.frame.stamp_ns - *other->added_ns > window_ns ||
        other->class_id != object.class_id || !alike(other->box, object.box, like_size_slack_m())) {
      continue;
    }
    // What was found on the same drive as the object itself is not where it went.
    const StampNs between_ns = other->first_seen_ns - object.last_seen_ns;
    if (between_ns <= kSameDrive * (step.frame.stamp_ns - other->first_seen_ns)) continue;
    const double distance = (other->box.pose.position_W - object.box.pose.position_W).norm();
    if (distance > config_.state.relocation_reach_m) continue;
    if (!best || distance < best_distance) best = other, best_distance = distance;
  }
  return best;
}

LibraryObject* ObjectTracker::new_place_of(const Step& step, const LibraryObject& object) {
  LibraryObject* best = nullptr;
  double best_distance = 0.0;
  for (const ObjectId id : step.in_view) {
    LibraryObject* other = library_.find(id);
    if (!other || other->confirmed || other->class_id != object.class_id || other->observations < 2 ||
        other->last_seen_ns != step.frame.stamp_ns) {
      continue;
    }
    const double distance = (other->box.pose.position_W - object.box.pose.position_W).norm();
    const bool part = other->growing && distance <= config_.state.relocation_reach_m &&
                      fits_inside(other->box, object.box, like_size_slack_m());
    if (!part && !alike(other->box, object.box, like_size_slack_m())) continue;
    const bool named = other->moved_from == object.id, best_named = best && best->moved_from == object.id;
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
  LibraryObject* elsewhere = object.confirmed && !successor ? added_like(step, object) : nullptr;
  if (elsewhere) {
    // Seen at its new place before the old one was seen empty.
    elsewhere->added_ns.reset();
    step.result.retired.push_back(id);
    ObjectEvent& event = add_event(step, EventKind::kMoved, *elsewhere, "was_" + std::to_string(to_index(id)));
    event.previous_box = object.box;
    event.evidence = step.evidence[id];
    event.evidence.rule = "was_" + std::to_string(to_index(id));
  } else if (object.confirmed && !successor) {
    add_event(step, EventKind::kRemoved, object, rule);
    step.result.retired.push_back(id);
    relocations_.remember({id, object.class_id, object.box, object.first_seen_ns, step.frame.stamp_ns});
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
    if (const auto rule = removal_rule(*object, config_.state, config_.change)) to_remove.emplace_back(id, *rule);
  }
  for (const auto& [id, rule] : to_remove) {
    if (library_.find(id)) remove(step, id, rule);
  }

  const auto needed = static_cast<std::uint32_t>(config_.state.confirm_observations);
  const auto wait = static_cast<std::uint32_t>(config_.state.wait_for_doubt_frames);
  std::vector<LibraryObject*> ready;
  for (const auto owner : step.owner_of_observation) {
    LibraryObject* object = owner == IntegrationInput::kSkip ? nullptr : library_.find(ObjectId{owner});
    if (!object || object->confirmed || object->observations < needed) continue;
    if (std::find(ready.begin(), ready.end(), object) == ready.end()) ready.push_back(object);
  }
  std::sort(ready.begin(), ready.end(), [](const auto* a, const auto* b) { return a->id < b->id; });
  for (LibraryObject* object : ready) {
    bool doubt = false;
    for (const ObjectId id : step.in_view) {
      const LibraryObject* other = library_.find(id);
      if (!other || other == object || !other->confirmed || other->class_id != object->class_id) continue;
      doubt = doubt || object->moved_from == id ||
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
    const double shift_m = (object->box.pose.position_W - object->reported_box.pose.position_W).norm();
    const double growth = (object->box.size_m - object->reported_box.size_m).cwiseAbs().maxCoeff();
    const double notable_m = std::max(config_.change.tau_m, 2.0 * config_.map.voxel_size_m);
    // Lost points at one end and gained as many at the other: it slid along itself.
    const double least = kSlidShare * static_cast<double>(object->model.surfels().size());
    if (static_cast<double>(object->lost) > least && static_cast<double>(object->gained) > least &&
        shift_m > notable_m && growth < notable_m) {
      ObjectEvent& event = add_event(step, EventKind::kMoved, *object, "slid");
      event.previous_box = object->reported_box;
    } else if (shift_m > notable_m || growth > notable_m) {
      add_event(step, EventKind::kUpdated, *object, object->lost > object->gained ? "part_removed" : "grew");
    } else {
      continue;
    }
    object->reported_box = object->box;
    object->gained = object->lost = 0;
  }
  for (const LibraryObject* object : touched) step.result.changed_objects.push_back(snapshot(*object));
  std::sort(step.result.retired.begin(), step.result.retired.end());
}

}  // namespace pocd
