#include "tracker_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pocd/common/cell_index.hpp"
#include "pocd/observe/geometric_change.hpp"
#include "pocd/track/apply_measurement.hpp"

namespace pocd {
namespace {

/// Points of established objects must have been measured in this many frames to shape the box.
constexpr int kEstablishedHits = 2;
/// An object that is found displaced in so many looks in a row has moved.
constexpr int kDisplacedLooks = 3;
/// Shorter motions than this share of the distance that verifies an object are noise.
constexpr double kNoiseShare = 0.6;

/// Cells of free space along the depth of view, at most: what is asked of them is coarse, and their
/// number per frame grows with the third power.
constexpr double kViewCells = 100.0;
/// So far in front of a surface a voxel was seen empty.
constexpr double kClearVoxels = 1.5;

}  // namespace

std::optional<PixelView> view_of(const OrganizedCloud& cloud, const Pose& T_C_W,
                                 const Eigen::Vector3d& point_W) {
  const Eigen::Vector3d p = T_C_W * point_W;
  if (p.z() <= 0.0) return std::nullopt;
  const int col = static_cast<int>(cloud.camera.fx * p.x() / p.z() + cloud.camera.cx + 0.5);
  const int row = static_cast<int>(cloud.camera.fy * p.y() / p.z() + cloud.camera.cy + 0.5);
  if (col < 0 || row < 0 || col >= cloud.width || row >= cloud.height) return std::nullopt;
  return PixelView{p.z(), cloud.depth_m[static_cast<std::size_t>(row) * cloud.width + col]};
}

ObjectTracker::ObjectTracker(const TrackerConfig& config)
    : config_(config),
      free_space_(std::max(2.0 * config.map.voxel_size_m, config.map.max_depth_m / kViewCells)) {}

void ObjectTracker::update(const Frame& frame, const OrganizedCloud& cloud, const DepthField& field,
                           const Observations& observations, const GroundModel& ground,
                           const DistanceAt& distance_at, MapEdits& edits,
                           std::vector<std::uint32_t>& owner_of_pixel, FrameResult& result) {
  Step step{frame,  cloud, field, observations, ground, distance_at, edits,
            result, {},    0,     {},           {},     {},          {}};
  step.sight = {config_.map.voxel_size_m, config_.change.pose_tolerance_m, config_.map.max_depth_m,
                config_.association.icp_max_distance_m};
  join_sides(step);
  look_at_objects(step);
  update_beliefs(step);
  fuse_parts(step);
  join_objects(step);
  lose_surface(step);
  remove_objects(step);
  confirm_objects(step);
  report_changes(step);
  paint_owners(observations, step.parts, step.owners, cloud, config_.map.voxel_size_m,
               owner_of_pixel);
  free_space_.update(cloud, field, config_.depth_noise, config_.map.max_depth_m,
                     config_.change.pose_tolerance_m);
  if (auto problem = free_space_.problem()) result.warnings.push_back(std::move(*problem));
}

void ObjectTracker::set_clock_back(StampNs newest_ns, StampNs now_ns) {
  const StampNs before_ns = now_ns - 1;
  const auto bound = [before_ns](StampNs& stamp_ns) { stamp_ns = std::min(stamp_ns, before_ns); };
  for (const auto& [id, object] : library_.all()) {
    bound(object->first_seen_ns);
    bound(object->last_seen_ns);
    bound(object->in_reach_ns);
    bound(object->visit_ns);
    bound(object->placed_ns);
    bound(object->in_place_ns);
    bound(object->unobserved_since_ns);
    bound(object->displaced_since_ns);
    if (object->added_ns) bound(*object->added_ns);
    for (Surfel& s : object->model.surfels()) bound(s.last_hit_ns);
    object->moment = {};
  }
  library_.touch_all();
  departures_.set_clock_back(newest_ns, before_ns);
}

void ObjectTracker::look_at_objects(Step& step) {
  const double reach = config_.map.max_depth_m;
  const ViewBall view = view_ball(step.cloud, reach);
  for (const ObjectId id : library_.near(view.center_W, view.radius_m)) {
    if (looks_.size() <= step.look_count) looks_.emplace_back();
    Look& look = looks_[step.look_count];
    look.object = library_.find(id);
    judge(step.cloud, step.field, step.observations, step.sight, config_.depth_noise, look);
    const Sighting& s = look.sighting;
    if (s.hit + s.seen_through + s.occluded + s.unknown == 0) continue;
    ++step.look_count;
  }
  for (std::size_t n = 0; n < step.look_count; ++n) {
    if (!looks_[n].object->confirmed) continue;
    align(step.cloud, step.field, step.observations, step.sight, config_.depth_noise,
          config_.association, kNoiseShare * step.sight.margin_m, looks_.data(), step.look_count,
          looks_[n]);
  }
  PartsConfig parts;
  parts.spacing_m = config_.map.voxel_size_m;
  parts.contact_m = config_.segmentation.cluster_tolerance_m;
  parts.least_points = std::max<std::size_t>(10, least_surfels());
  step.parts = divide(
      step.observations, looks_.data(), step.look_count,
      [&](const Eigen::Vector3f& p) { return seen_empty(step.distance_at, p); }, parts);
}

void ObjectTracker::update_beliefs(Step& step) {
  for (std::size_t n = 0; n < step.look_count; ++n) {
    Look& look = looks_[n];
    LibraryObject& object = *look.object;
    const bool first = moment_of(step, object).robots.size() == 1;
    // A look that is contested does not say that it stands where it was.
    if (look.verdict != Verdict::kDisplaced && !look.contested) object.looks_displaced = 0;
    switch (look.verdict) {
      case Verdict::kTooLittleSeen:
      case Verdict::kHidden:
        break;
      case Verdict::kInPlace:
        measure(step, look, geometric_change(look.sighting, config_.change));
        object.in_place_ns = step.frame.stamp_ns;
        object.looks_unobserved = 0;
        break;
      case Verdict::kDisplaced:
        object.looks_unobserved = 0;
        if (first && object.looks_displaced++ == 0) object.displaced_since_ns = step.frame.stamp_ns;
        if (object.looks_displaced >= kDisplacedLooks && lasts(step, object.displaced_since_ns))
          move_displaced(step, look);
        break;
      case Verdict::kUnobserved:
        if (!measure(step, look, config_.change.delta_max_m)) break;
        if (object.looks_unobserved == 0) object.unobserved_since_ns = step.frame.stamp_ns;
        if (!std::exchange(object.moment.seen_through, true)) ++object.looks_unobserved;
        break;
    }
  }
}

bool ObjectTracker::lasts(const Step& step, StampNs since_ns) const {
  return step.frame.stamp_ns - since_ns >= static_cast<StampNs>(config_.state.moment_s * 1e9);
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

bool ObjectTracker::measure(Step& step, Look& look, double delta_m) {
  LibraryObject& object = *look.object;
  Moment& moment = moment_of(step, object);
  const int points = look.sighting.visible();
  if (moment.robots.size() > 1 && moment.measured) {
    // What the object does between two moments is asked once: two cameras that look at the same
    // time do not make it twice as certain that it stays.
    if (points <= moment.points) return false;
    object.belief = moment.before;
  }
  moment.measured = true;
  moment.points = points;
  step.evidence[object.id] = apply_measurement(object, delta_m, measurement_sigma(step, object),
                                               look.sighting, config_.state, config_.change);
  mark_changed(object);
  return true;
}

double ObjectTracker::measurement_sigma(const Step& step, const LibraryObject& object) const {
  const double depth_m = (step.cloud.T_W_C.inverse() * object.centroid_W).z();
  return std::hypot(config_.change.tau_m,
                    config_.change.depth_noise_factor * config_.depth_noise.sigma(depth_m));
}

void ObjectTracker::fuse_parts(Step& step) {
  step.owners.assign(step.parts.size(), ObjectId::kNone);
  std::vector<LibraryObject*> seen;
  for (std::size_t p = 0; p < step.parts.size(); ++p) {
    Part& part = step.parts[p];
    LibraryObject* object = part.look ? part.look->object : nullptr;
    if (!object) object = &create(step, step.observations.list[part.observation].class_id);
    // On a contested surface what was measured may be another place of it.
    if (!part.look || !part.look->contested) fuse(step, *object, part.points);
    object->most_free =
        std::max(object->most_free, step.observations.list[part.observation].free_beside_share);
    step.owners[p] = object->id;
    if (std::find(seen.begin(), seen.end(), object) == seen.end()) seen.push_back(object);
  }
  for (LibraryObject* object : seen) {
    object->arrival = object->confirmed ? object->arrival : arrival_of(*object);
    const std::size_t surfels = object->model.surfels().size();
    object->most_surfels = std::max(object->most_surfels, surfels);
    // The box follows the model; refitting for every few points would cost more than it tells.
    const auto difference =
        std::abs(static_cast<double>(surfels) - static_cast<double>(object->box_surfels));
    if (object->observations < 10 || difference > 0.02 * static_cast<double>(surfels))
      refit_box(step, *object);
  }
  for (std::size_t n = 0; n < step.look_count; ++n) {
    LibraryObject& object = *looks_[n].object;
    if (object.confirmed || object.last_seen_ns == step.frame.stamp_ns) continue;
    const Sighting& s = looks_[n].sighting;
    if (2 * s.occluded < s.hit + s.seen_through + s.occluded + s.unknown) ++object.looks_missed;
  }
}

void ObjectTracker::fuse(Step& step, LibraryObject& object,
                         const std::vector<SurfacePoint>& points) {
  const std::size_t known = object.model.surfels().size();
  object.model.fuse(points, step.frame.stamp_ns);
  if (object.confirmed) hide_space_behind(step, object, known);
  object.icp_target.reset();
  Moment& moment = moment_of(step, object);
  if (!std::exchange(moment.observed, true)) ++object.observations;
  object.last_seen_ns = step.frame.stamp_ns;
  object.last_robot = step.frame.robot;
  if (!step.frame.robot.empty() && !object.note_seer(step.frame.robot)) {
    step.result.warnings.push_back("object " + std::to_string(to_index(object.id)) +
                                   " was seen by more than " +
                                   std::to_string(LibraryObject::kMostSeers) +
                                   " robots: " + step.frame.robot + " is not listed");
  }
  mark_changed(object);
}

void ObjectTracker::hide_space_behind(Step& step, const LibraryObject& object, std::size_t from) {
  const Eigen::Vector3f eye_W = step.cloud.T_W_C.translation().cast<float>();
  const auto& surfels = object.model.surfels();
  for (std::size_t i = from; i < surfels.size(); ++i) {
    if (surfels[i].arrived)
      free_space_.forget_behind(eye_W, surfels[i].point_W, longest_side(object.box));
  }
}

LibraryObject& ObjectTracker::create(Step& step, ClassId class_id) {
  LibraryObject& object = library_.create(config_.map.voxel_size_m);
  object.class_id = class_id;
  object.stationarity_class = config_.classes.stationarity_class(class_id);
  object.belief.sigma = config_.state.initial_sigma_m;
  forget_evidence(object.belief, config_.state);
  object.first_seen_ns = step.frame.stamp_ns;
  object.in_reach_ns = object.visit_ns = object.placed_ns = object.in_place_ns =
      step.frame.stamp_ns;
  // Another view of this moment tells nothing of what the object does between two moments.
  Moment& moment = moment_of(step, object);
  moment.measured = true;
  moment.points = std::numeric_limits<int>::max();
  return object;
}

std::optional<OrientedBox> ObjectTracker::fit(const Step& step, LibraryObject& object) const {
  Points points, normals;
  points.reserve(object.model.surfels().size());
  normals.reserve(object.model.surfels().size());
  const int min_hits = object.observations > 4 ? kEstablishedHits : 1;
  for (const Surfel& s : object.model.surfels()) {
    if (s.hits < min_hits || s.seen_through >= 3) continue;
    points.push_back(s.point_W);
    normals.push_back(s.normal_W);
  }
  if (points.size() < 3) {
    for (const Surfel& s : object.model.surfels()) {
      points.push_back(s.point_W);
      normals.push_back(s.normal_W);
    }
  }
  if (points.empty()) return std::nullopt;
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
  return box;
}

void ObjectTracker::refit_box(Step& step, LibraryObject& object) {
  const auto box = fit(step, object);
  if (!box) return;
  object.box_surfels = object.model.surfels().size();
  library_.place(object, *box);
}

void ObjectTracker::forget_sights(Step& step, const LibraryObject& object) {
  for (std::size_t n = 0; n < step.look_count; ++n) {
    if (looks_[n].object == &object) looks_[n].sighting.sights.clear();
  }
}

Arrival ObjectTracker::arrival_of(const LibraryObject& object) const {
  std::size_t arrived = 0;
  for (const Surfel& s : object.model.surfels()) arrived += s.arrived;
  const double share =
      static_cast<double>(arrived) / static_cast<double>(object.model.surfels().size());
  return share > 0.3 ? Arrival::kArrived : share > 0.1 ? Arrival::kUnknown : Arrival::kFound;
}

bool ObjectTracker::seen_empty(const DistanceAt& distance_at,
                               const Eigen::Vector3f& point_W) const {
  if (free_space_.seen_empty(point_W)) return true;
  // Near surfaces the map knows better.
  const auto distance_m = distance_at(point_W);
  return distance_m && *distance_m > kClearVoxels * config_.map.voxel_size_m;
}

double ObjectTracker::contact_m() const {
  return std::max(config_.segmentation.cluster_tolerance_m, 2.0 * config_.map.voxel_size_m);
}

std::size_t ObjectTracker::least_surfels() const {
  const double spacing_m = config_.map.voxel_size_m;
  return static_cast<std::size_t>(
      std::ceil(config_.segmentation.min_cluster_area_m2 / (spacing_m * spacing_m)));
}

void ObjectTracker::mark_changed(LibraryObject& object) {
  if (!object.changed) changed_.push_back(object.id);
  object.changed = true;
}

Evidence ObjectTracker::evidence_of(const Step& step, const LibraryObject& object) const {
  const auto it = step.evidence.find(object.id);
  if (it != step.evidence.end()) return it->second;
  Evidence evidence;
  evidence.stationarity_class = object.stationarity_class;
  evidence.before = evidence.after = object.belief;
  return evidence;
}

ObjectEvent& ObjectTracker::add_event(Step& step, EventKind kind, const LibraryObject& object,
                                      Rule rule, ObjectId other) {
  ObjectEvent event;
  event.sequence = next_event_++;
  event.kind = kind;
  event.object = object.id;
  event.class_id = object.class_id;
  event.stamp_ns = step.frame.stamp_ns;
  event.frame_sequence = step.frame.sequence;
  event.robot = step.frame.robot;
  event.box = object.box;
  if (kind == EventKind::kAdded) event.arrival = object.arrival;
  event.evidence = evidence_of(step, object);
  event.evidence.rule = rule_text(rule, other);
  step.result.events.push_back(std::move(event));
  return step.result.events.back();
}

}  // namespace pocd
