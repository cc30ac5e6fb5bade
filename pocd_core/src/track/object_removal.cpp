// ObjectTracker: losing surface, and removing objects.
#include <algorithm>
#include <cmath>

#include "pocd/common/cell_index.hpp"
#include "pocd/observe/align_in_place.hpp"
#include "pocd/track/apply_measurement.hpp"
#include "tracker_step.hpp"

namespace pocd {
namespace {

/// A part that is smaller than this share of its object and of the least area that counts is an
/// edge: it is dropped, and the object reported as updated only when its box changes.
constexpr double kPartShare = 0.1;
/// The rest of an object that is found gone stands when at least this share of what was seen since
/// is in place.
constexpr double kStandingShare = 0.15;
/// What is found gone is an edge of what was measured on this visit up to this share of it.
constexpr double kEdgeShare = 0.1;
/// What lies before the surface that is gone is another wall from this share of all surfels on.
constexpr double kOtherWallShare = 0.3;
/// Surfels that are gone before which it may lie.
constexpr std::size_t kOtherWallPoints = 200;
/// Looks in a row before a known object is taken for gone, whatever its belief.
constexpr int kGoneLooks = 3;
/// A candidate that was seen through in this many looks was never there, or moves.
constexpr int kCandidateGoneLooks = 2;
/// A candidate that was not measured for long lapses when it has been looked at for so long in this
/// visit [s].
constexpr double kLapseLookS = 1.0;
/// An object that lost more than this share of its surface to erosion is gone.
constexpr double kLeastSurfelShare = 0.15;

/// Marks what belongs to the marked surfels among those that nothing is known of: the ones nearer
/// to a marked surfel than to a standing one.
void mark_unseen(const std::vector<Surfel>& surfels, const std::vector<std::uint8_t>& standing,
                 std::vector<std::uint8_t>& marked) {
  // A few of each are enough to tell which are nearer.
  constexpr std::size_t kSample = 200;
  std::vector<std::size_t> gone, there;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (marked[i]) gone.push_back(i);
    if (standing[i]) there.push_back(i);
  }
  const auto nearest2 = [&](const std::vector<std::size_t>& set, std::size_t i) {
    const std::size_t step = std::max<std::size_t>(1, set.size() / kSample);
    float best = std::numeric_limits<float>::infinity();
    for (std::size_t k = 0; k < set.size(); k += step)
      best = std::min(best, (surfels[set[k]].point_W - surfels[i].point_W).squaredNorm());
    return best;
  };
  std::vector<std::uint8_t> more = marked;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!marked[i] && !standing[i]) more[i] = nearest2(gone, i) < nearest2(there, i) ? 1 : 0;
  }
  marked = more;
}

/// Marks as standing what nothing is known of when it lies before most of what is gone, by more
/// than `before_m`, as the other wall of a corner does: it is no part of the body that is gone.
/// Returns how many surfels it marked; none when they are few.
std::size_t spare_other_wall(const std::vector<Surfel>& surfels,
                             const std::vector<std::uint8_t>& gone, double before_m,
                             std::vector<std::uint8_t>& standing) {
  const std::vector<const Surfel*> some = some_surfels(surfels, gone, kOtherWallPoints);
  std::vector<std::size_t> before;
  std::vector<const Surfel*> wall;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (gone[i] || standing[i]) continue;
    if (!is_before(some, surfels[i].point_W, before_m)) continue;
    before.push_back(i);
    wall.push_back(&surfels[i]);
  }
  if (static_cast<double>(before.size()) < kOtherWallShare * static_cast<double>(surfels.size()))
    return 0;
  // The near wall of a container lies before the far one, but not the other way round.
  if (!lie_before(some, wall, before_m)) return 0;
  for (const std::size_t i : before) standing[i] = 1;
  return before.size();
}

/// Size of the largest connected piece of the marked surfels.
std::size_t largest_piece(const std::vector<Surfel>& surfels,
                          const std::vector<std::uint8_t>& marked, double reach_m) {
  CellIndex cells;
  const float inverse = static_cast<float>(1.0 / reach_m);
  std::vector<std::int32_t> parent;
  std::vector<Eigen::Vector3f> points;
  const auto root = [&](std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!marked[i]) continue;
    const auto k = static_cast<std::int32_t>(points.size());
    const Eigen::Vector3f& p = surfels[i].point_W;
    points.push_back(p);
    parent.push_back(k);
    cells.insert(cell_key(p, inverse), k);
    const auto x = static_cast<std::int64_t>(std::floor(p.x() * inverse));
    const auto y = static_cast<std::int64_t>(std::floor(p.y() * inverse));
    const auto z = static_cast<std::int64_t>(std::floor(p.z() * inverse));
    for (int n = 0; n < 27; ++n) {
      const auto other = cells.find(cell_key(x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1));
      if (other == CellIndex::kNone) continue;
      const std::int32_t a = root(other), b = root(k);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<std::size_t> size(points.size(), 0);
  std::size_t most = 0;
  for (std::size_t k = 0; k < points.size(); ++k)
    most = std::max(most, ++size[root(static_cast<std::int32_t>(k))]);
  return most;
}

OrientedBox box_of(const std::vector<Surfel>& surfels) {
  Points points, normals;
  for (const Surfel& s : surfels) {
    points.push_back(s.point_W);
    normals.push_back(s.normal_W);
  }
  return fit_box(points, normals, 0.005);
}

}  // namespace

void ObjectTracker::lose_surface(Step& step) {
  const int frames = config_.state.erode_frames;
  for (std::size_t n = 0; n < step.look_count; ++n) {
    Look& look = looks_[n];
    const auto& sights = look.sighting.sights;
    if (sights.empty()) continue;
    LibraryObject& object = *look.object;
    auto& surfels = object.model.surfels();
    // Fusion appends; the first ones are still those that were looked at.
    std::size_t pending = 0, gone = 0;
    for (std::size_t i = 0; i < sights.size(); ++i) {
      if (sights[i] == Sight::kSeenThrough && surfels[i].seen_through < 250)
        ++surfels[i].seen_through;
      if (sights[i] != Sight::kHit || !look.fits) continue;
      surfels[i].seen_through = 0;
      surfels[i].last_hit_ns = step.frame.stamp_ns;
    }
    if (frames == 0 || look.verdict == Verdict::kUnobserved ||
        look.verdict == Verdict::kDisplaced) {
      continue;
    }
    for (const Surfel& s : surfels) {
      gone += s.seen_through >= frames;
      pending += s.seen_through > 0 && s.seen_through < frames;
    }
    if (gone == 0) {
      object.looks_losing = 0;
      continue;
    }
    // A part that is being found gone is taken as a whole.
    if (pending > gone / 10 && ++object.looks_losing < 2 * frames) continue;
    object.looks_losing = 0;
    std::vector<std::uint8_t> marked(surfels.size(), 0);
    for (std::size_t i = 0; i < surfels.size(); ++i) marked[i] = surfels[i].seen_through >= frames;
    lose_part(step, object, marked, Rule::kPartSeenThrough);
  }
}

void ObjectTracker::lose_part(Step& step, LibraryObject& object,
                              const std::vector<std::uint8_t>& marked, Rule rule) {
  const OrientedBox whole_box = object.box;
  const std::size_t before = object.model.surfels().size();
  const std::size_t piece =
      largest_piece(object.model.surfels(), marked, 2.0 * config_.map.voxel_size_m);
  std::vector<Surfel> lost = object.model.extract(marked);
  object.icp_target.reset();
  object.lost += lost.size();
  mark_changed(object);
  forget_sights(step, object);
  if (!object.model.surfels().empty()) refit_box(step, object);
  const bool is_part = object.confirmed && piece >= 2 * least_surfels() &&
                       static_cast<double>(piece) >= kPartShare * static_cast<double>(before);
  if (!is_part) return;
  // What was never measured where the thing is now did not leave: the thing went another way.
  const auto here = std::count_if(
      lost.begin(), lost.end(), [&](const Surfel& s) { return s.last_hit_ns >= object.placed_ns; });
  if (object.moved && 2 * static_cast<std::size_t>(here) < lost.size()) return;
  const double voxel_m = config_.map.voxel_size_m, band_m = 2.0 * config_.map.truncation_m();
  const auto gone = std::make_shared<const IcpTarget>(icp_target(lost, voxel_m, band_m));
  const auto standing =
      object.model.surfels().empty()
          ? nullptr
          : std::make_shared<const IcpTarget>(icp_target(object.model.surfels(), voxel_m, band_m));
  const OrientedBox lost_box = box_of(lost);
  const double reach_m = 0.5 * lost_box.size_m.norm() + config_.map.truncation_m();
  clear_gone(step, object.id,
             [gone, standing, reach_m, middle_W = Eigen::Vector3d(lost_box.pose.position_W)](
                 const Eigen::Vector3d& center_W) {
               if ((center_W - middle_W).norm() > reach_m) return false;
               const auto a = gone->nearest((center_W - gone->origin_W()).cast<float>());
               if (!a) return false;
               if (!standing) return true;
               const auto b = standing->nearest((center_W - standing->origin_W()).cast<float>());
               return !b || a->squared_distance_m2 < b->squared_distance_m2;
             });
  Departure departure;
  departure.id = library_.reserve_id();
  departure.part_of = object.id;
  departure.class_id = object.class_id;
  departure.box = lost_box;
  departure.surfels = std::move(lost);
  departure.first_seen_ns = object.first_seen_ns;
  // When most of it was still there: a few points lie on what came after it.
  std::vector<StampNs> hits;
  for (const Surfel& s : departure.surfels) hits.push_back(s.last_hit_ns);
  std::nth_element(hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(hits.size() / 2),
                   hits.end());
  departure.in_place_ns = hits[hits.size() / 2];
  departure.departed_ns = step.frame.stamp_ns;
  departure.arrival = object.arrival;
  departure.seen_by = object.seen_by;
  departure.evidence = evidence_of(step, object);
  if (object.belief.stationarity() < config_.state.remove_below) {
    // That was measured of what is gone. The rest was measured in place.
    begin_anew(step, object);
  }
  add_event(step, EventKind::kUpdated, object, Rule::kPartRemoved).previous_box = whole_box;
  object.reported_box = object.box;
  object.lost = 0;
  depart(step, std::move(departure), rule);
}

void ObjectTracker::begin_anew(Step& step, LibraryObject& object) {
  forget_evidence(object.belief, config_.state);
  step.evidence.erase(object.id);
}

void ObjectTracker::clear_gone(Step& step, ObjectId id, MapEdits::Where inside) {
  const double near_m = 2.0 * config_.map.voxel_size_m;
  // As they are now: the edit is made once all is decided.
  std::vector<std::pair<OrientedBox, ObjectModel>> others;
  if (const LibraryObject* object = library_.find(id)) {
    for (const ObjectId other_id :
         library_.near(object->box.pose.position_W, 0.5 * object->box.size_m.norm())) {
      const LibraryObject* other = library_.find(other_id);
      if (other_id != id && box_overlap(other->box, object->box, 2.0 * near_m) > 0.0)
        others.emplace_back(other->box, other->model);
    }
  }
  step.edits.clear(
      id, [inside = std::move(inside), others = std::move(others), near_m, &cloud = step.cloud,
           T_C_W = Pose(step.cloud.T_W_C.inverse())](const Eigen::Vector3d& center_W) {
        if (!inside(center_W)) return false;
        const auto view = view_of(cloud, T_C_W, center_W);
        const bool measured_now =
            view && view->depth_m >= near_m && std::abs(view->measured_m - view->depth_m) < near_m;
        return !measured_now && std::none_of(others.begin(), others.end(), [&](const auto& other) {
          const Eigen::Vector3f center = center_W.cast<float>();
          return is_inside(other.first, near_m, center) &&
                 other.second.nearest(center, static_cast<float>(near_m)) != ObjectModel::kNone;
        });
      });
}

void ObjectTracker::remove_objects(Step& step) {
  std::vector<std::pair<LibraryObject*, Verdict>> looked;
  for (std::size_t n = 0; n < step.look_count; ++n)
    looked.emplace_back(looks_[n].object, looks_[n].verdict);
  std::sort(looked.begin(), looked.end());
  looked.erase(std::unique(looked.begin(), looked.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first; }),
               looked.end());
  std::sort(looked.begin(), looked.end(),
            [](const auto& a, const auto& b) { return a.first->id < b.first->id; });
  const auto lapse_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  const auto looked_ns = static_cast<StampNs>(kLapseLookS * 1e9);
  for (const auto& [object, verdict] : looked) {
    if (!object->confirmed) {
      if (object->looks_unobserved >= kCandidateGoneLooks ||
          object->belief.stationarity() < config_.state.remove_below) {
        remove(step, *object, Rule::kCandidateSeenThrough);
      } else if (object->looks_missed > config_.state.tentative_frames) {
        remove(step, *object, Rule::kNeverConfirmed);
      } else if (step.frame.stamp_ns - object->last_seen_ns > lapse_ns &&
                 step.frame.stamp_ns - object->visit_ns > looked_ns) {
        remove(step, *object, Rule::kCandidateLapsed);
      }
      continue;
    }
    if (static_cast<double>(object->model.surfels().size()) <
        kLeastSurfelShare * static_cast<double>(object->most_surfels)) {
      remove(step, *object, Rule::kNothingLeft);
      continue;
    }
    if (verdict != Verdict::kUnobserved || object->looks_unobserved < kGoneLooks ||
        !lasts(step, object->unobserved_since_ns) ||
        object->belief.stationarity() >= config_.state.remove_below) {
      continue;
    }
    // An act is no larger than its evidence: what was measured in place since stands.
    const auto& surfels = object->model.surfels();
    const Pose T_C_W = step.cloud.T_W_C.inverse();
    std::vector<std::size_t> passed;
    std::vector<std::uint8_t> gone(surfels.size(), 0), standing(surfels.size(), 0);
    std::size_t gone_count = 0, standing_count = 0;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      gone[i] = surfels[i].seen_through > 0;
      standing[i] = !gone[i] && surfels[i].last_hit_ns >= object->unobserved_since_ns;
      gone_count += gone[i];
      standing_count += standing[i];
      if (!gone[i] && !standing[i] && surfels[i].last_hit_ns >= object->visit_ns &&
          !view_of(step.cloud, T_C_W, surfels[i].point_W.cast<double>())) {
        passed.push_back(i);
      }
    }
    // So does what was measured on this visit and is out of view now, unless much is found gone.
    if (static_cast<double>(gone_count) <=
        kEdgeShare * static_cast<double>(gone_count + standing_count + passed.size())) {
      for (const std::size_t i : passed) standing[i] = 1;
      standing_count += passed.size();
    }
    standing_count += spare_other_wall(surfels, gone, 2.0 * contact_m(), standing);
    if (static_cast<double>(standing_count) <=
        kStandingShare * static_cast<double>(standing_count + gone_count)) {
      remove(step, *object, Rule::kStationarityBelowThreshold);
      continue;
    }
    mark_unseen(surfels, standing, gone);
    object->looks_unobserved = 0;
    lose_part(step, *object, gone, Rule::kStationarityBelowThreshold);
    if (object->belief.stationarity() < config_.state.remove_below) begin_anew(step, *object);
  }
}

void ObjectTracker::remove(Step& step, LibraryObject& object, Rule rule) {
  Departure departure;
  departure.id = object.id;
  departure.class_id = object.class_id;
  departure.box = object.box;
  departure.surfels = object.model.surfels();
  departure.first_seen_ns = object.first_seen_ns;
  departure.in_place_ns = object.in_place_ns;
  departure.first_gone_ns = object.looks_unobserved > 0 ? object.unobserved_since_ns : 0;
  departure.departed_ns = step.frame.stamp_ns;
  departure.arrival = object.arrival;
  departure.seen_by = object.seen_by;
  departure.evidence = evidence_of(step, object);
  const bool was_known = object.confirmed;
  // What lapses was hidden: nobody has seen that it is not there.
  if (rule != Rule::kCandidateLapsed)
    clear_gone(step, object.id, [](const Eigen::Vector3d&) { return true; });
  step.edits.reassign(object.id, ObjectId::kNone);  // what stays is not of it
  std::replace(step.owners.begin(), step.owners.end(), object.id, ObjectId::kNone);
  const ObjectId id = object.id;
  for (std::size_t n = 0; n < step.look_count; ++n) {
    if (looks_[n].object != &object) continue;
    std::swap(looks_[n], looks_[--step.look_count]);
    --n;
  }
  library_.erase(id);
  if (was_known) depart(step, std::move(departure), rule);
}

}  // namespace pocd
