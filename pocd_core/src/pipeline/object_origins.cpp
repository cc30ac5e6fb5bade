// ObjectTracker: what a new object is: a part of something known, something that moved, or new.
#include <algorithm>
#include <cmath>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// This share of a new thing within the room that another needs is a part of that.
constexpr double kInsideShare = 0.7;
/// What stands in so much of a thing of another class has replaced it.
constexpr double kReplacedShare = 0.5;
/// Farther apart are no two parts of one thing [m].
constexpr double kReach_m = 3.0;
/// Two things whose boxes would overlap by this share of the smaller one are not both there.
constexpr double kTakenShare = 0.25;
/// This share of a thing's surface in places that were seen empty makes it an arrival.
constexpr double kArrivedShare = 0.3;
/// One thing left and another was found on the same pass of a camera when so little lies between.
constexpr double kSamePass_s = 4.0;
/// Nothing is moved unseen in less time.
constexpr double kAbsence_s = 5.0;
/// An object that lost this share of its points lately is eroded by free space.
constexpr double kErodedShare = 0.12;
/// This share of the points at one end was seen through, lately or for good.
constexpr double kSeenEndShare = 0.2;

/// Whether the known object was there before the new one, and not seen in its place since.
bool unseen_since(const LibraryObject& known, const LibraryObject& found) {
  return known.first_seen_ns < found.first_seen_ns && known.verified_ns < found.first_seen_ns;
}

}  // namespace

bool ObjectTracker::explain(Step& step, LibraryObject& found) {
  if (!config_.state.explain_new) return false;
  if (LibraryObject* whole = part_of(step, found)) {
    absorb(step, *whole, found);
    return true;
  }
  if (LibraryObject* displaced = displaced_by(step, found)) {
    remove(step, displaced->id, "place_taken", &found);
    return true;
  }
  if (origin_of(step, found)) return false;
  if (LibraryObject* whole = completed_by(found)) {
    absorb(step, *whole, found);
    return true;
  }
  return false;
}

template <class Test>
LibraryObject* ObjectTracker::first_known(const LibraryObject& found, double reach_m,
                                          const Test& test) {
  for (const ObjectId id : library_.near(found.box.pose.position_W, reach_m)) {
    LibraryObject* other = library_.find(id);
    if (id != found.id && other->confirmed && test(*other)) return other;
  }
  return nullptr;
}

LibraryObject* ObjectTracker::part_of(const Step& step, const LibraryObject& found) {
  return first_known(found, found.box.size_m.norm(), [&](const LibraryObject& other) {
    // Both are there, and two solid things are not in one place.
    return other.class_id == found.class_id && other.first_seen_ns <= found.first_seen_ns &&
           other.verified_ns >= found.first_seen_ns && takes_place_of(step, found, other);
  });
}

LibraryObject* ObjectTracker::displaced_by(const Step& step, const LibraryObject& found) {
  return first_known(found, found.box.size_m.norm(), [&](const LibraryObject& other) {
    return other.class_id == found.class_id && unseen_since(other, found) &&
           other.contested_ns >= found.first_seen_ns && may_be(step, found, known_box(other)) &&
           takes_place_of(step, found, other);
  });
}

LibraryObject* ObjectTracker::replaced_by(const Step& step, const LibraryObject& found) {
  if (!config_.state.explain_new) return nullptr;
  return first_known(found, found.box.size_m.norm(), [&](const LibraryObject& other) {
    return other.class_id != found.class_id && unseen_since(other, found) &&
           other.contested_ns == step.frame.stamp_ns &&
           box_overlap(found.box, other.box, config_.state.least_depth_m) >= kReplacedShare;
  });
}

LibraryObject* ObjectTracker::completed_by(const LibraryObject& found) {
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  return first_known(found, kReach_m, [&](const LibraryObject& other) {
    if (other.class_id != found.class_id || other.expected_box.size_m.isZero() ||
        other.frames_seen_through > 0) {
      return false;
    }
    OrientedBox room = other.expected_box;
    room.size_m += Eigen::Vector3d::Constant(2.0 * margin_m);
    return box_overlap(found.box, room, margin_m) >= kInsideShare &&
           fits_inside(found.box, other.expected_box, like_size_slack_m());
  });
}

void ObjectTracker::take_rest(Step& step, LibraryObject& moved) {
  for (const ObjectId id :
       library_.near(moved.box.pose.position_W, moved.expected_box.size_m.norm())) {
    LibraryObject* other = library_.find(id);
    if (config_.state.explain_new && other->added_ns && completed_by(*other) == &moved)
      absorb(step, moved, *other);
  }
}

bool ObjectTracker::may_be_part(const Step& step, const LibraryObject& found) {
  if (!config_.state.explain_new || !found.cut) return false;
  const double margin_m = config_.state.least_depth_m;
  OrientedBox around = found.box;
  around.size_m += Eigen::Vector3d(2.0 * margin_m, 2.0 * margin_m, 0.0);
  return first_known(found, around.size_m.norm(), [&](const LibraryObject& other) {
    return other.class_id == found.class_id && unseen_since(other, found) &&
           box_overlap(around, other.box, margin_m) > 0.0 &&
           fits_inside(found.box, filled(other.box, step.cloud.T_W_C.translation(), margin_m),
                       like_size_slack_m());
  });
}

bool ObjectTracker::takes_place_of(const Step& step, const LibraryObject& found,
                                   const LibraryObject& known) const {
  const Eigen::Vector3d eye_W = step.cloud.T_W_C.translation();
  const double least_m = config_.state.least_depth_m;
  return box_overlap(filled(found.box, eye_W, least_m), filled(known_box(known), eye_W, least_m),
                     0.0) >= kTakenShare;
}

bool ObjectTracker::may_be(const Step& step, const LibraryObject& found,
                           const OrientedBox& known) const {
  const double slack_m = like_size_slack_m();
  // Of a thing that was seen from one side its depth is not known.
  OrientedBox a = found.box, b = known;
  for (OrientedBox* box : {&a, &b})
    box->size_m.head<2>() = box->size_m.head<2>().cwiseMax(config_.state.least_depth_m);
  if (alike(a, b, slack_m)) return true;
  const double distance = (a.pose.position_W - b.pose.position_W).norm();
  if (distance > config_.state.relocation_reach_m || !fits_inside(a, b, slack_m)) return false;
  if (same_side(a, b, slack_m)) return true;
  // What is not seen whole yet may still grow into the size. What stood behind need not have come
  // from anywhere.
  const double higher_m = b.size_m.z() - a.size_m.z();
  const bool may_grow_up = found.cut_above || higher_m <= std::max(slack_m, 0.2 * b.size_m.z());
  return (found.growing || found.cut) && may_grow_up && !revealed_by(step, found, known);
}

bool ObjectTracker::revealed_by(const Step& step, const LibraryObject& found,
                                const OrientedBox& known) const {
  const Eigen::Vector3d eye_W = step.cloud.T_W_C.translation();
  const double least_m = config_.state.least_depth_m;
  // Both were not there at once if they overlap.
  if (box_overlap(filled(found.box, eye_W, least_m), filled(known, eye_W, least_m), 0.0) > 0.0)
    return false;
  std::size_t hidden = 0;
  for (const Surfel& s : found.model.surfels()) {
    if (hides(known, eye_W, s.point_W.cast<double>())) ++hidden;
  }
  return 2 * hidden > found.model.surfels().size();
}

std::size_t ObjectTracker::missing(const LibraryObject& object) {
  return object.eroded - std::min(object.eroded, object.returned);
}

bool ObjectTracker::is_eroded(const LibraryObject& object) {
  const auto surfels = static_cast<double>(object.model.surfels().size());
  return static_cast<double>(missing(object)) > kErodedShare * surfels;
}

bool ObjectTracker::beyond_sides(const OrientedBox& box, const Eigen::Vector3f& point_W) const {
  const Eigen::AngleAxisd turn(-box.pose.yaw_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d at = turn * (point_W.cast<double>() - box.pose.position_W);
  return (at.cwiseAbs() - 0.5 * box.size_m).head<2>().maxCoeff() > 2.0 * config_.map.voxel_size_m;
}

bool ObjectTracker::reaches_beyond(const Observation& observation, const OrientedBox& box) const {
  const auto beyond =
      std::count_if(observation.points.begin(), observation.points.end(),
                    [&](const SurfacePoint& p) { return beyond_sides(box, p.point_W); });
  return static_cast<double>(beyond) >
         kArrivedShare * static_cast<double>(observation.points.size());
}

const OrientedBox& ObjectTracker::known_box(const LibraryObject& object) {
  return is_eroded(object) ? object.reported_box : object.box;
}

bool ObjectTracker::has_arrived(LibraryObject& object) const {
  if (!object.arrived) {
    Points points_W;
    for (const Surfel& s : object.model.surfels()) points_W.push_back(s.point_W);
    object.arrived =
        views_.seen_empty_share(points_W, object.first_seen_ns, config_.map.max_depth_m,
                                config_.change.tau_m) > kArrivedShare;
  }
  return *object.arrived;
}

std::optional<ObjectTracker::Origin> ObjectTracker::origin_of(const Step& step,
                                                              LibraryObject& found) {
  const StateConfig& state = config_.state;
  const StampNs now_ns = step.frame.stamp_ns;
  const Eigen::Vector3d& here_W = found.box.pose.position_W;
  // In a place that was not seen before, a thing is new only if another like it left about when it
  // was found.
  const auto pass_ns = static_cast<StampNs>(kSamePass_s * 1e9);
  const auto left_then = [&](StampNs contested_since_ns, StampNs contested_ns) {
    return contested_since_ns < found.first_seen_ns + pass_ns &&
           contested_ns > found.first_seen_ns - pass_ns;
  };
  const auto distance_to = [&](const OrientedBox& box) {
    return (box.pose.position_W - here_W).head<2>().norm();
  };
  std::optional<Origin> best;
  for (const auto& removed : relocations_.recent(now_ns, state.relocation_window_s)) {
    const double distance = distance_to(removed.box);
    if (removed.class_id != found.class_id || !may_be(step, found, removed.box)) continue;
    // What was seen in its place when the new one was there, too, is another thing.
    if (removed.verified_ns >= found.first_seen_ns) continue;
    if (!has_arrived(found) && (distance > state.relocation_reach_m ||
                                !left_then(removed.contested_since_ns, removed.removed_ns)))
      continue;
    if (!best || distance < best->distance_m) best = Origin{&removed, nullptr, distance};
  }
  const auto absence_ns = static_cast<StampNs>(kAbsence_s * 1e9);
  for (const ObjectId id : library_.near(here_W, state.relocation_reach_m)) {
    LibraryObject* other = library_.find(id);
    if (id == found.id || !other->confirmed || other->class_id != found.class_id ||
        !unseen_since(*other, found) || !may_be(step, found, known_box(*other))) {
      continue;
    }
    const bool contested = other->contested_ns >= found.first_seen_ns;
    if (!contested && found.first_seen_ns - other->verified_ns < absence_ns) continue;
    if (!has_arrived(found) && !left_then(other->contested_since_ns, other->contested_ns)) continue;
    const double distance = distance_to(known_box(*other));
    if (distance > state.relocation_reach_m) continue;
    if (!best || distance < best->distance_m) best = Origin{nullptr, other, distance};
  }
  return best;
}

LibraryObject* ObjectTracker::new_place_of(const Step& step, const LibraryObject& object) {
  LibraryObject* best = nullptr;
  double best_distance = 0.0;
  const auto window_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  for (const ObjectId id :
       library_.near(object.box.pose.position_W, config_.state.relocation_reach_m)) {
    LibraryObject* other = library_.find(id);
    if (other == &object || other->class_id != object.class_id) continue;
    const bool named = !other->confirmed && other->moved_from == object.id;
    if (!named && other->observations < 2) continue;
    const bool open = other->confirmed
                          ? other->added_ns && step.frame.stamp_ns - *other->added_ns <= window_ns
                          : other->last_seen_ns == step.frame.stamp_ns;
    if (!open) continue;
    const auto origin = origin_of(step, *other);
    if (!named && (!origin || origin->live != &object)) continue;
    if (named && revealed_by(step, *other, known_box(object)) &&
        !may_be(step, *other, known_box(object)))
      continue;
    // Aligned with it and found alike.
    const double distance_m = named ? 0.0 : origin->distance_m;
    if (!best || distance_m < best_distance) best = other, best_distance = distance_m;
  }
  return best;
}

void ObjectTracker::link_additions(Step& step) {
  const auto window_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  const std::vector<ObjectId> ids = changed_;
  for (const ObjectId id : ids) {
    LibraryObject* object = library_.find(id);
    if (!object || !notable_change(*object)) continue;
    if (!object->expected_box.size_m.isZero()) take_rest(step, *object);
    if (!object->added_ns || step.frame.stamp_ns - *object->added_ns > window_ns) continue;
    if (explain(step, *object)) continue;
    const auto origin = origin_of(step, *object);
    if (origin && origin->removed) report_move(step, *object, *origin->removed, "recognised");
  }
}

std::optional<ObjectTracker::GrownEnd> ObjectTracker::grown_end(const Step& step,
                                                                const LibraryObject& object,
                                                                const OrientedBox& then) const {
  const StampNs before_ns = step.frame.stamp_ns - static_cast<StampNs>(kAbsence_s * 1e9);
  if (!config_.state.explain_new || object.first_seen_ns >= before_ns || object.gained == 0)
    return std::nullopt;
  // How far each end of each axis went.
  GrownEnd end;
  double grown_m = 2.0 * config_.map.voxel_size_m;
  for (const int axis : {0, 1}) {
    const double yaw = then.pose.yaw_rad + (axis == 0 ? 0.0 : 0.5 * M_PI);
    const Eigen::Vector3d along_W(std::cos(yaw), std::sin(yaw), 0.0);
    const double center_m = (object.box.pose.position_W - then.pose.position_W).dot(along_W);
    const double wider_m = 0.5 * (object.box.size_m[axis] - then.size_m[axis]);
    for (const double sign : {-1.0, 1.0}) {
      const double m = wider_m + sign * center_m;
      if (m <= grown_m || m > then.size_m[axis]) continue;
      grown_m = m;
      end = {sign * along_W, 0.5 * then.size_m[axis], m};
    }
  }
  if (end.grown_m == 0.0) return std::nullopt;
  Points gained_W;
  for (const Surfel& s : object.model.surfels()) {
    const Eigen::Vector3d offset_W = s.point_W.cast<double>() - then.pose.position_W;
    if (offset_W.dot(end.along_W) > end.half_length_m) gained_W.push_back(s.point_W);
  }
  if (views_.seen_empty_share(gained_W, before_ns, config_.map.max_depth_m,
                              2.0 * config_.map.voxel_size_m) < kArrivedShare) {
    return std::nullopt;
  }
  return end;
}

bool ObjectTracker::slide(Step& step, LibraryObject& object) {
  if (object.grew_ns && step.frame.stamp_ns - *object.grew_ns >
                            static_cast<StampNs>(config_.state.relocation_window_s * 1e9)) {
    object.grew_ns.reset();
  }
  const OrientedBox then = object.grew_ns ? object.box_before_growth : object.reported_box;
  const auto end = grown_end(step, object, then);
  if (!end) return false;
  // As far as the new end lies beyond the old one, the other end must have been left.
  auto& surfels = object.model.surfels();
  const auto left_behind = [&](const Surfel& s) {
    const Eigen::Vector3d offset_W = s.point_W.cast<double>() - then.pose.position_W;
    return -offset_W.dot(end->along_W) > end->half_length_m - end->grown_m;
  };
  std::size_t there = 0, through = 0;
  for (const Surfel& s : surfels) {
    if (!left_behind(s)) continue;
    ++there;
    through += s.seen_through > 0;
  }
  // What was eroded there is gone for good.
  const std::size_t gone = through + object.eroded;
  if (static_cast<double>(gone) < kSeenEndShare * static_cast<double>(there + object.eroded)) {
    if (!object.grew_ns) object.box_before_growth = then, object.grew_ns = step.frame.stamp_ns;
    return false;
  }
  for (Surfel& s : surfels) {
    if (left_behind(s)) s.seen_through = kLeftBehind;
  }
  object.model.erode(kLeftBehind);
  object.icp_target.reset();
  // Voxels of both ends are of the same owner: all go, and what is there comes back with the next
  // looks.
  step.map.clear_object(object.id);
  object.grew_ns.reset();
  object.reported_box = then;
  refit_box(step, object);
  return true;
}

}  // namespace pocd
