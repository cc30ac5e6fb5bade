#include "tracker_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pocd/change/geometric_change.hpp"

namespace pocd {
namespace {

/// Points of an established object must have been measured in this many frames to bear witness.
constexpr int kEstablishedHits = 2;
/// When so large a share of at least so many points is off by more than half the verifying
/// distance, the object is aligned anew; when it lies elsewhere in so many frames in a row, it has
/// moved.
constexpr double kOddShare = 0.25;
constexpr int kShiftPoints = 60;
constexpr int kDisplacedFrames = 3;
constexpr int kOddFrames = 10;
/// An observation that adds at least this share of points shows that the object is not seen whole
/// yet.
constexpr double kGrowingShare = 0.03;
/// Seen in its place: at least so many points and this share of those in view are measured there.
/// Above the share that a thing keeps when it slides along itself by a third.
constexpr int kPresentPoints = 30;
constexpr double kPresentShare = 0.8;
/// An outline that is cut off by more than this share belongs to something that is not seen whole.
constexpr double kCutShare = 0.1;
constexpr double kCutAboveShare = 0.2;
/// Its place is in question when this share of the points in view is seen through or covered.
constexpr double kContestedShare = 0.25;

}  // namespace

void ObjectTracker::update(const Frame& frame, const OrganizedCloud& cloud, const DepthField& field,
                           const Observations& observations, const GroundModel& ground,
                           TsdfMap& map, std::vector<std::uint32_t>& owner_of_observation,
                           FrameResult& result) {
  owner_of_observation.assign(observations.list.size(), IntegrationInput::kSkip);
  Step step{frame,  cloud, field, observations, ground, map, owner_of_observation,
            result, 0,     {},    {},           {},     {}};
  find_candidates(step);
  step.association = associate(candidates_.data(), step.candidate_count, observations, cloud.T_W_C,
                               config_.association);
  note_presence(step);
  update_matched(step);
  update_unmatched(step);
  erode(step);
  add_new(step);
  join_companions(step);
  remove_or_confirm(step);
  link_additions(step);
  report_changes(step);
  views_.add(cloud, frame.stamp_ns);
}

void ObjectTracker::set_clock_back(StampNs now_ns) {
  const StampNs before_ns = now_ns - 1;
  const auto bound = [before_ns](StampNs& stamp_ns) { stamp_ns = std::min(stamp_ns, before_ns); };
  for (const auto& [id, object] : library_.all()) {
    bound(object->first_seen_ns);
    bound(object->last_seen_ns);
    bound(object->verified_ns);
    bound(object->contested_ns);
    bound(object->contested_since_ns);
    if (object->grew_ns) bound(*object->grew_ns);
    if (object->added_ns) bound(*object->added_ns);
    object->moment = {};
  }
  library_.touch_all();
  relocations_.set_clock_back(before_ns);
  views_.set_clock_back(before_ns);
}

void ObjectTracker::find_candidates(Step& step) {
  const double reach = config_.map.max_depth_m;
  const ViewBall view = view_ball(step.cloud, reach);
  const SightConfig sight{0.5 * config_.change.tau_m, config_.change.pose_tolerance_m, reach};
  for (const ObjectId id : library_.near(view.center_W, view.radius_m)) {
    LibraryObject& object = *library_.find(id);
    if (candidates_.size() <= step.candidate_count) candidates_.emplace_back();
    Candidate& candidate = candidates_[step.candidate_count];
    candidate.object = &object;
    const int min_hits = object.observations > 2 ? kEstablishedHits : 1;
    sight_object(object.model, object.class_id, min_hits, step.cloud, step.field, step.observations,
                 sight, config_.depth_noise, candidate.sighting);
    const Sighting& s = candidate.sighting;
    if (s.hit + s.seen_through + s.occluded + s.unknown == 0) continue;
    ++step.candidate_count;
    step.in_view.push_back(id);
  }
}

void ObjectTracker::note_presence(Step& step) {
  for (std::size_t c = 0; c < step.candidate_count; ++c) {
    LibraryObject& object = *candidates_[c].object;
    const Sighting& s = candidates_[c].sighting;
    const int in_view = s.hit + s.seen_through + s.occluded + s.unknown;
    int covered = 0;
    for (const auto& touch : s.touches) {
      if (step.observations.list[touch.observation].class_id == object.class_id)
        covered += touch.in_front;
    }
    // Points where masks show another class do not show this object; without masks none speaks
    // against it.
    const int other = step.frame.labels.empty() ? 0 : s.hit_other_class;
    const int own = s.hit - other;
    // Nor does what free space left of it: as much of that as of the rest would be in view.
    const double in_view_share = static_cast<double>(in_view) / std::max(1, s.total);
    const double eroded =
        is_eroded(object) ? static_cast<double>(missing(object)) * in_view_share : 0.0;
    if (!step.association.doubtful[c] && own >= kPresentPoints &&
        own >= kPresentShare * (in_view + eroded)) {
      object.verified_ns = step.frame.stamp_ns;
    } else if (step.association.doubtful[c] ||
               s.seen_through + covered + other > kContestedShare * in_view) {
      if (object.contested_since_ns <= object.verified_ns)
        object.contested_since_ns = step.frame.stamp_ns;
      object.contested_ns = step.frame.stamp_ns;
    }
  }
}

void ObjectTracker::update_matched(Step& step) {
  const double verified_m = 0.5 * config_.change.tau_m;
  for (const Match& match : step.association.matches) {
    LibraryObject& object = *candidates_[match.candidate].object;
    const Sighting& sighting = candidates_[match.candidate].sighting;
    const Observation& observation = step.observations.list[match.observation];
    object.frames_seen_through = 0;
    // What free space erodes does not grow on the other side: that may be where it went.
    if (match.stationary && object.confirmed && is_eroded(object) &&
        reaches_beyond(observation, object.reported_box)) {
      step.moved_from[match.observation] = object.id;
      step.association.unassigned.push_back(match.observation);
      continue;
    }
    if (config_.association.realign_displaced && object.confirmed &&
        shift_object(step, object, match, sighting)) {
      continue;
    }
    // A few points at an edge say nothing about the whole.
    if (match.stationary && sighting.visible() < kPresentPoints &&
        sighting.visible_share() < config_.association.min_visible_share) {
      fuse(step, object, match.observation);
      step.owner_of_observation[match.observation] = to_index(object.id);
      continue;
    }
    const double delta_m =
        geometric_change(object, observation, sighting, match, step.cloud, config_.change);
    measure(step, object, delta_m, sighting);
    mark_changed(object);
    if (match.displacement_m <= verified_m && std::abs(delta_m) <= verified_m) {
      fuse(step, object, match.observation);
      step.owner_of_observation[match.observation] = to_index(object.id);
    } else if (match.displacement_m > verified_m) {
      // Discarded as evidence of this object; it may be where the object is now.
      step.moved_from[match.observation] = object.id;
      step.association.unassigned.push_back(match.observation);
    } else if (!object.confirmed && moment_of(step, object).robots.size() == 1) {
      ++object.frames_in_view;  // in its place, but not where its surface was taken to be
    }
  }
  for (const auto& piece : step.association.pieces) {
    LibraryObject& object = *candidates_[piece.candidate].object;
    fuse(step, object, piece.observation);
    step.owner_of_observation[piece.observation] = to_index(object.id);
  }
}

bool ObjectTracker::shift_object(Step& step, LibraryObject& object, const Match& match,
                                 const Sighting& sighting) {
  const double verified_m = 0.5 * config_.change.tau_m;
  const auto touch =
      std::find_if(sighting.touches.begin(), sighting.touches.end(),
                   [&](const auto& t) { return t.observation == match.observation; });
  int odd = touch == sighting.touches.end() ? 0 : touch->in_front;
  const int seen = sighting.visible() + odd;
  for (const float d : sighting.differences_m) {
    if (std::abs(d) > 0.5 * verified_m) ++odd;
  }
  const bool suspicious = seen >= kShiftPoints && odd > kOddShare * seen;
  std::optional<Match> moved;
  if (!match.stationary) {
    // Aligned already; what went farther is judged by its belief.
    if (match.displacement_m > verified_m || !suspicious) return false;
    moved = match;
  } else if (suspicious) {
    moved = align_in_place(object, step.observations.list[match.observation], step.cloud.T_W_C,
                           config_.association);
  }
  // An edge that fits says nothing of where the rest went.
  const Eigen::Vector3d& center_W = object.box.pose.position_W;
  if (moved &&
      (moved->T_new_old * center_W - center_W).norm() > moved->displacement_m + 2.0 * verified_m) {
    moved.reset();
  }
  if (!moved || moved->displacement_m < 0.6 * verified_m) {
    object.frames_displaced = 0;
    // What lies beside the surface for a while may be the object, turned, of which too little is
    // seen yet to tell: fused, it would make the two places one model.
    const int looks = moment_of(step, object).robots.size() == 1 ? 1 : 0;
    object.frames_odd = suspicious ? object.frames_odd + looks : 0;
    return match.stationary && suspicious && object.frames_odd <= kOddFrames;
  }
  // Not fused: it would smear the model between the two places.
  if (moment_of(step, object).robots.size() == 1) ++object.frames_displaced;
  if (object.frames_displaced < kDisplacedFrames) return true;
  object.frames_displaced = 0;
  const OrientedBox previous_box = object.box;
  object.model.transform(moved->T_new_old);
  candidates_[match.candidate].sighting.sights.clear();  // of points that are elsewhere now
  object.icp_target.reset();
  step.map.clear_object(object.id);
  refit_box(step, object);
  mark_changed(object);
  step.evidence[object.id] =
      apply_measurement(object, moved->sign * moved->displacement_m,
                        measurement_sigma(step, object), sighting, config_.state, config_.change);
  // Change is measured from the new place on.
  step.evidence[object.id].after.mu = object.belief.mu = 0.0;
  object.moment = {};
  add_event(step, EventKind::kMoved, object, "aligned_elsewhere").previous_box = previous_box;
  object.reported_box = object.box;
  object.gained = object.eroded = object.returned = 0;
  step.owner_of_observation[match.observation] = to_index(object.id);
  return true;
}

Moment& ObjectTracker::moment_of(Step& step, LibraryObject& object) {
  const std::string& robot = step.frame.robot;
  const StampNs stamp_ns = step.frame.stamp_ns;
  Moment& moment = object.moment;
  if (!moment.robots.empty() && moment.robots.back() == robot && moment.frame_ns == stamp_ns) {
    return moment;
  }
  const auto length_ns = static_cast<StampNs>(config_.state.moment_s * 1e9);
  const bool same =
      !moment.robots.empty() && stamp_ns >= moment.start_ns &&
      stamp_ns - moment.start_ns <= length_ns &&
      std::find(moment.robots.begin(), moment.robots.end(), robot) == moment.robots.end();
  if (!same) {
    moment = {};
    moment.start_ns = stamp_ns;
    moment.before = object.belief;
  }
  moment.frame_ns = stamp_ns;
  moment.robots.push_back(robot);
  return moment;
}

bool ObjectTracker::measure(Step& step, LibraryObject& object, double delta_m,
                            const Sighting& sighting) {
  Moment& moment = moment_of(step, object);
  const int points = sighting.visible();
  if (moment.robots.size() > 1 && moment.measured) {
    // What the object does between two moments is asked once: two cameras that look at the same
    // time do not make it twice as certain that it stays.
    if (points <= moment.points) return false;
    object.belief = moment.before;
  }
  moment.measured = true;
  moment.points = points;
  step.evidence[object.id] = apply_measurement(object, delta_m, measurement_sigma(step, object),
                                               sighting, config_.state, config_.change);
  return true;
}

double ObjectTracker::measurement_sigma(const Step& step, const LibraryObject& object) const {
  const double depth_m = (step.cloud.T_W_C.inverse() * object.centroid_W).z();
  return std::hypot(config_.change.tau_m,
                    config_.change.depth_noise_factor * config_.depth_noise.sigma(depth_m));
}

void ObjectTracker::update_unmatched(Step& step) {
  std::vector<bool> matched(step.candidate_count, false);
  for (const Match& match : step.association.matches) matched[match.candidate] = true;
  for (std::size_t c = 0; c < step.candidate_count; ++c) {
    if (matched[c]) continue;
    LibraryObject& object = *candidates_[c].object;
    const Sighting& sighting = candidates_[c].sighting;
    const bool aware = config_.association.occlusion_aware;
    double share = aware ? sighting.visible_share() : sighting.in_view_share();
    if (aware && is_eroded(object) && sighting.visible() >= kPresentPoints) {
      // Points that were dropped because they were seen through were seen, too.
      const auto eroded = static_cast<double>(missing(object));
      share = (sighting.visible() + eroded) / (sighting.total + eroded);
    }
    if (share < config_.association.min_visible_share) continue;
    Moment& moment = moment_of(step, object);
    if (!object.confirmed && moment.robots.size() == 1) ++object.frames_in_view;
    if (aware && !step.association.doubtful[c]) continue;
    if (!measure(step, object, config_.change.delta_max_m, sighting)) continue;
    if (!std::exchange(moment.seen_through, true)) ++object.frames_seen_through;
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
      if (sights[i] == Sight::kSeenThrough && surfels[i].seen_through + 1 < kLeftBehind)
        ++surfels[i].seen_through;
      if (sights[i] == Sight::kHit) surfels[i].seen_through = 0;
    }
    if (config_.state.erode_frames == 0) continue;
    if (const int eroded = object.model.erode(config_.state.erode_frames); eroded > 0) {
      object.icp_target.reset();
      object.eroded += static_cast<std::size_t>(eroded);
      mark_changed(object);
      if (!object.model.surfels().empty()) refit_box(step, object);
    }
  }
}

void ObjectTracker::fuse(Step& step, LibraryObject& object, std::int32_t index) {
  const Observation& observation = step.observations.list[index];
  const int added = object.model.fuse(observation.points);
  object.gained += static_cast<std::size_t>(added);
  // What comes back where it was is no loss: poses err, and thin outlines come and go.
  const auto& all = object.model.surfels();
  const auto back = std::count_if(all.end() - added, all.end(), [&](const Surfel& s) {
    return !beyond_sides(object.reported_box, s.point_W);
  });
  object.returned += static_cast<std::size_t>(back);
  object.growing = added > kGrowingShare * static_cast<double>(object.model.surfels().size());
  object.cut = observation.cut_share > kCutShare;
  object.cut_above = observation.cut_above_share > kCutAboveShare;
  object.icp_target.reset();
  Moment& moment = moment_of(step, object);
  if (moment.robots.size() == 1 || !moment.observed) ++object.observations;
  moment.observed = true;
  object.last_seen_ns = step.frame.stamp_ns;
  object.last_robot = step.frame.robot;
  if (!step.frame.robot.empty()) object.seen_by.insert(step.frame.robot);
  mark_changed(object);
  const std::size_t surfels = object.model.surfels().size();
  object.most_surfels = std::max(object.most_surfels, surfels);
  // The box follows the model; refitting for every few points would cost more than it tells.
  const auto difference =
      std::abs(static_cast<double>(surfels) - static_cast<double>(object.box_surfels));
  if (object.observations < 10 || difference > 0.02 * static_cast<double>(surfels))
    refit_box(step, object);
}

void ObjectTracker::refit_box(Step& step, LibraryObject& object) {
  Points points, normals;
  points.reserve(object.model.surfels().size());
  normals.reserve(object.model.surfels().size());
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
    if (bottom > ground_m &&
        bottom - ground_m < 2.0 * config_.segmentation.ground_band_m + config_.map.voxel_size_m) {
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
    // The first look says what is there; another one in the same moment, nothing of whether it
    // stays.
    object.moment.measured = true;
    object.moment.points = std::numeric_limits<int>::max();
    step.owner_of_observation[index] = to_index(object.id);
  }
}

}  // namespace pocd
