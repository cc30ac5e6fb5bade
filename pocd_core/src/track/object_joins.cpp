// ObjectTracker: which objects are one thing, and how they are joined.
#include <algorithm>
#include <cmath>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// Two objects are seen in one piece when this many points of each are measured on it.
constexpr int kSharedPoints = 10;
/// Share of a found object that lies within another one's box when it is another side of it.
constexpr double kInsideShare = 0.6;
/// From this share on it is, whether it was found or arrived: no other thing stands within a thing.
constexpr double kWithinShare = 0.9;
/// Two objects are one when this share of the smaller one lies on the other.
constexpr double kSameShare = 0.5;
/// A side that departed went along with a thing that moved: at the new place, at least this share of
/// it is seen, or it was within the thing; at most this share of what is known there is empty.
constexpr double kAlongSeenShare = 0.2;
constexpr double kAlongEmptyShare = 0.15;
/// Surfels of each object between which it is asked what was seen through.
constexpr std::size_t kGapPoints = 150;
/// Of the lines between facing surfaces of one body, at most this share crosses seen space or runs
/// outside of it.
constexpr double kGapShare = 0.2;
/// A line runs outside of a body when it leaves its surface by more than this, as a cosine with the
/// normal.
constexpr float kOutside = 0.4f;

}  // namespace

bool ObjectTracker::may_be_one(const LibraryObject& a, const LibraryObject& b) const {
  // Two things that moved, each as a whole, are two; what arrived is no side of what stood there.
  if (a.moved && b.moved) return false;
  const bool a_arrived = a.arrival == Arrival::kArrived, b_arrived = b.arrival == Arrival::kArrived;
  return a_arrived == b_arrived;
}

bool ObjectTracker::connected(const LibraryObject& a, const LibraryObject& b) const {
  const bool a_less = a.model.surfels().size() < b.model.surfels().size();
  const LibraryObject& small = a_less ? a : b;
  const LibraryObject& large = a_less ? b : a;
  const auto reach = static_cast<float>(
      std::max(config_.segmentation.cluster_tolerance_m, 2.0 * config_.map.voxel_size_m));
  int contacts = 0, checked = 0;
  for (const Surfel& s : small.model.surfels()) {
    if (s.hits < 2 || s.seen_through > 0) continue;
    ++checked;
    const int other = large.model.nearest(s.point_W, reach);
    contacts += other != ObjectModel::kNone && large.model.surfels()[other].seen_through == 0;
  }
  // A seam, not a spot: about the square root of the smaller surface's size.
  return contacts >= std::max(3.0, 0.5 * std::sqrt(static_cast<double>(checked)));
}

bool ObjectTracker::coincide(const LibraryObject& a, const LibraryObject& b) const {
  const bool a_less = a.model.surfels().size() < b.model.surfels().size();
  const LibraryObject& small = a_less ? a : b;
  const LibraryObject& large = a_less ? b : a;
  if (box_overlap(a.box, b.box, 2.0 * config_.map.voxel_size_m) < kSameShare) return false;
  const auto reach = static_cast<float>(1.5 * config_.map.voxel_size_m);
  const std::size_t step = std::max<std::size_t>(1, small.model.surfels().size() / 100);
  std::size_t asked = 0, same = 0;
  for (std::size_t i = 0; i < small.model.surfels().size(); i += step) {
    ++asked;
    same += large.model.nearest(small.model.surfels()[i].point_W, reach) != ObjectModel::kNone;
  }
  return static_cast<double>(same) >= kSameShare * static_cast<double>(asked);
}

bool ObjectTracker::sides_of_one(Step& step, const LibraryObject& a,
                                 const LibraryObject& b) const {
  const auto sample = [](const LibraryObject& object) {
    std::vector<const Surfel*> some;
    const auto& surfels = object.model.surfels();
    const std::size_t step = std::max<std::size_t>(1, surfels.size() / kGapPoints);
    for (std::size_t i = 0; i < surfels.size(); i += step) {
      if (surfels[i].hits >= 2 && surfels[i].seen_through == 0) some.push_back(&surfels[i]);
    }
    return some;
  };
  const bool a_less = a.model.surfels().size() < b.model.surfels().size();
  const auto from = sample(a_less ? a : b), to = sample(a_less ? b : a);
  const auto reach_m = static_cast<float>(std::max(longest_side(a.box), longest_side(b.box)));
  struct Line {
    float length_m;
    const Surfel *from, *to;
  };
  std::vector<Line> lines;
  for (const Surfel* p : from) {
    Line best{std::numeric_limits<float>::infinity(), p, p};
    for (const Surfel* q : to) {
      const float length_m = (q->point_W - p->point_W).norm();
      if (length_m < best.length_m) best.length_m = length_m, best.to = q;
    }
    lines.push_back(best);
  }
  if (lines.empty()) return false;
  // The half that faces the other one.
  std::sort(lines.begin(), lines.end(),
            [](const Line& l, const Line& r) { return l.length_m < r.length_m; });
  lines.resize((lines.size() + 1) / 2);
  if (lines.front().length_m > reach_m) return false;
  const auto cell_m = static_cast<float>(2.0 * config_.map.voxel_size_m);
  std::size_t crossing = 0;
  for (const Line& line : lines) {
    const Eigen::Vector3f along = (line.to->point_W - line.from->point_W) / line.length_m;
    bool open = line.length_m > reach_m || line.from->normal_W.dot(along) > kOutside ||
                line.to->normal_W.dot(along) < -kOutside;
    for (float at = cell_m; !open && at < line.length_m - 0.5f * cell_m; at += 0.5f * cell_m)
      open = seen_empty(step.map, line.from->point_W + at * along);
    crossing += open;
  }
  return static_cast<double>(crossing) <= kGapShare * static_cast<double>(lines.size());
}

void ObjectTracker::join_sides(Step& step) {
  const auto gap_ns = static_cast<StampNs>(config_.state.visit_gap_s * 1e9);
  const ViewBall view = view_ball(step.cloud, config_.map.max_depth_m);
  std::vector<ObjectId> visited;
  for (const ObjectId id : library_.near(view.center_W, view.radius_m)) {
    LibraryObject* object = library_.find(id);
    const bool anew = step.frame.stamp_ns - object->in_reach_ns > gap_ns;
    object->in_reach_ns = step.frame.stamp_ns;
    if (!anew) continue;
    object->visit_ns = step.frame.stamp_ns;
    if (object->confirmed) visited.push_back(id);
  }
  for (const ObjectId id : visited) {
    for (bool joined = true; joined;) {
      joined = false;
      LibraryObject* object = library_.find(id);
      if (!object) break;
      for (const ObjectId other_id :
           library_.near(object->box.pose.position_W, object->box.size_m.norm())) {
        LibraryObject* other = library_.find(other_id);
        if (other_id == id || !other->confirmed || other->class_id != object->class_id ||
            object->looks_unobserved > 0 || other->looks_unobserved > 0 ||
            !may_be_one(*object, *other) || !sides_of_one(step, *object, *other)) {
          continue;
        }
        const bool older = object->id < other->id;
        absorb(step, older ? *object : *other, older ? *other : *object);
        joined = true;
        break;
      }
    }
  }
}

void ObjectTracker::join_objects(Step& step) {
  const int enough = config_.state.merge_frames;
  std::vector<std::pair<ObjectId, ObjectId>> joined;
  for (std::size_t a = 0; a < step.look_count; ++a) {
    Look& look_a = looks_[a];
    if (look_a.verdict != Verdict::kInPlace || look_a.contested) continue;
    for (std::size_t b = a + 1; b < step.look_count; ++b) {
      Look& look_b = looks_[b];
      LibraryObject &x = *look_a.object, &y = *look_b.object;
      if (look_b.verdict != Verdict::kInPlace || look_b.contested || x.class_id != y.class_id ||
          (!may_be_one(x, y) && !coincide(x, y))) {
        continue;
      }
      bool one_piece = false, apart = false;
      for (const auto& t : look_a.sighting.touches) {
        if (t.hit < kSharedPoints) continue;
        for (const auto& u : look_b.sighting.touches) {
          if (u.hit < kSharedPoints) continue;
          one_piece |= t.observation == u.observation;
          apart |= t.observation != u.observation &&
                   step.observations.list[t.observation].instance != 0 &&
                   step.observations.list[u.observation].instance != 0;
        }
      }
      const auto count = x.companions.find(y.id);
      if (!one_piece || apart) {
        // Once seen as two, they have to be seen as one for as long again.
        const bool both =
            look_a.sighting.hit >= kSharedPoints && look_b.sighting.hit >= kSharedPoints;
        if (both && count != x.companions.end() && --count->second <= 0) x.companions.erase(count);
        continue;
      }
      if (coincide(x, y)) {
        joined.emplace_back(x.id, y.id);
        continue;
      }
      int& looks = x.companions[y.id];
      if (++looks < enough) continue;
      looks = 0;
      if (connected(x, y)) joined.emplace_back(x.id, y.id);
    }
  }
  for (const auto& [a, b] : joined) {
    LibraryObject *survivor = library_.find(a), *absorbed = library_.find(b);
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
  // Both were seen in the same looks, for the most part.
  survivor.observations = std::max(survivor.observations, absorbed.observations);
  survivor.seen_by.insert(absorbed.seen_by.begin(), absorbed.seen_by.end());
  survivor.in_place_ns = std::max(survivor.in_place_ns, absorbed.in_place_ns);
  survivor.last_seen_ns = std::max(survivor.last_seen_ns, absorbed.last_seen_ns);
  survivor.companions.clear();
  mark_changed(survivor);
  step.map.reassign_object(absorbed_id, survivor.id);
  std::replace(step.owners.begin(), step.owners.end(), absorbed_id, survivor.id);
  for (std::size_t n = 0; n < step.look_count; ++n) {
    if (looks_[n].object != &absorbed) continue;
    looks_[n].object = &survivor;
    looks_[n].sighting.sights.clear();  // of surfels that are listed elsewhere now
  }
  library_.erase(absorbed_id);
  refit_box(step, survivor);
  if (!was_known) return;
  step.result.retired.push_back(absorbed_id);
  add_event(step, EventKind::kUpdated, survivor, "joined_" + std::to_string(to_index(absorbed_id)))
      .absorbed = absorbed_id;
  survivor.reported_box = survivor.box;
}

ObjectTracker::Along ObjectTracker::went_along(Step& step, const Departure& departure,
                                               const Move& move) {
  LibraryObject* moved = library_.find(move.id);
  if (!moved || departure.class_id != move.class_id || departure.id == move.id ||
      departure.part_of == move.id || departure.in_place_ns > move.moved_ns) {
    return Along::kNo;
  }
  // What arrived after it left is another thing.
  if (departure.arrival == Arrival::kArrived && departure.first_seen_ns > move.in_place_ns)
    return Along::kNo;
  const double reach_m = longest_side(move.from);
  const double apart_m =
      (departure.box.pose.position_W - move.from.pose.position_W).head<2>().norm();
  if (apart_m > 0.5 * longest_side(departure.box) + 1.5 * reach_m) return Along::kNo;
  std::vector<LibraryObject*> arrivals;
  for (const ObjectId id : library_.near(moved->box.pose.position_W, reach_m + apart_m)) {
    LibraryObject* other = library_.find(id);
    if (id != move.id && other->class_id == move.class_id && other->added_ns &&
        other->first_seen_ns > std::max(move.in_place_ns, departure.in_place_ns)) {
      arrivals.push_back(other);
    }
  }
  const Eigen::Isometry3f T = move.T_new_old.cast<float>();
  const auto radius = static_cast<float>(config_.map.voxel_size_m);
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  std::vector<Surfel> sides;
  std::vector<int> on_arrival(arrivals.size(), 0);
  int on_moved = 0, seen = 0, empty = 0, inside = 0;
  for (Surfel s : departure.surfels) {
    inside += is_inside(move.from, margin_m, s.point_W);
    s.point_W = T * s.point_W;
    s.normal_W = T.linear() * s.normal_W;
    s.seen_through = 0;
    const bool met = moved->model.nearest(s.point_W, radius) != ObjectModel::kNone;
    bool measured = met;
    on_moved += met;
    for (std::size_t k = 0; k < arrivals.size(); ++k) {
      if (arrivals[k]->model.nearest(s.point_W, radius) == ObjectModel::kNone) continue;
      ++on_arrival[k];
      measured = true;
    }
    seen += measured;
    if (!measured && seen_empty(step.map, s.point_W)) {
      ++empty;
      continue;
    }
    sides.push_back(s);
  }
  const auto all = static_cast<double>(departure.surfels.size());
  if (empty > kAlongEmptyShare * (seen + empty)) return Along::kNo;
  if (on_moved >= kAlongSeenShare * all || inside >= kInsideShare * all) {
    moved->model.add(sides);
    moved->icp_target.reset();
    moved->most_surfels = std::max(moved->most_surfels, moved->model.surfels().size());
    refit_box(step, *moved);
    mark_changed(*moved);
    ObjectEvent& event = add_event(step, EventKind::kUpdated, *moved,
                                   "joined_" + std::to_string(to_index(departure.id)));
    if (departure.part_of == ObjectId::kNone) event.absorbed = departure.id;
    moved->reported_box = moved->box;
    return Along::kJoined;
  }
  const auto most = std::max_element(on_arrival.begin(), on_arrival.end());
  if (most == on_arrival.end() || *most < kAlongSeenShare * all) return Along::kNo;
  report_move(step, *arrivals[most - on_arrival.begin()], departure, move.T_new_old,
              "moved_alike");
  return Along::kMoved;
}

void ObjectTracker::gather_sides(Step& step, Move move) {
  if (!library_.find(move.id)) return;
  std::vector<Departure> departures;
  for (const Departure& d :
       departures_.recent(step.frame.stamp_ns, config_.state.relocation_window_s)) {
    departures.push_back(d);
  }
  for (const Departure& d : departures) {
    // A move of another side may have told what became of it.
    if (!departures_.has(d.id)) continue;
    if (went_along(step, d, move) == Along::kJoined) departures_.forget(d.id);
  }
  // What was seen there first since it moved, and lies within it, is of it.
  const LibraryObject* moved = library_.find(move.id);
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  for (const ObjectId id :
       library_.near(moved->box.pose.position_W, 0.5 * moved->box.size_m.norm())) {
    LibraryObject* other = library_.find(id);
    if (id == move.id || other->class_id != move.class_id || !other->added_ns ||
        other->first_seen_ns <= move.in_place_ns) {
      continue;
    }
    std::size_t inside = 0;
    for (const Surfel& s : other->model.surfels())
      inside += is_inside(moved->box, margin_m, s.point_W);
    if (static_cast<double>(inside) >=
        kInsideShare * static_cast<double>(other->model.surfels().size())) {
      absorb(step, *library_.find(move.id), *other);
    }
  }
}

bool ObjectTracker::seen_apart(const Step& step, ObjectId a, ObjectId b) const {
  const auto instance_of = [&](std::size_t p) {
    return step.observations.list[step.parts[p].observation].instance;
  };
  for (std::size_t p = 0; p < step.parts.size(); ++p) {
    if (step.owners[p] != a || instance_of(p) == 0) continue;
    for (std::size_t q = 0; q < step.parts.size(); ++q) {
      if (step.owners[q] == b && instance_of(q) != 0 && instance_of(q) != instance_of(p))
        return true;
    }
  }
  return false;
}

bool ObjectTracker::surroundings_known(const LibraryObject& found,
                                       const LibraryObject& known) const {
  // A thing that arrived may stand beside another that arrived in the same visit.
  if (found.arrival == Arrival::kArrived) return known.visit_ns > known.placed_ns;
  const auto gap_ns = static_cast<StampNs>(config_.state.visit_gap_s * 1e9);
  return found.first_seen_ns - known.placed_ns > gap_ns;
}

LibraryObject* ObjectTracker::whole_of(Step& step, const LibraryObject& found) {
  const auto window_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  const bool arrived = found.arrival == Arrival::kArrived;
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  for (const ObjectId id : library_.near(found.box.pose.position_W, found.box.size_m.norm())) {
    LibraryObject* other = library_.find(id);
    if (id == found.id || !other->confirmed || other->class_id != found.class_id ||
        other->looks_unobserved > 0 || seen_apart(step, found.id, id)) {
      continue;
    }
    if (coincide(found, *other)) return other;
    std::size_t inside = 0;
    for (const Surfel& s : found.model.surfels())
      inside += is_inside(other->box, margin_m, s.point_W);
    const double share =
        static_cast<double>(inside) / static_cast<double>(found.model.surfels().size());
    if (share >= kWithinShare) return other;
    // What arrived is a side of what arrived lately; what was found, of what stands longer, too.
    const bool other_arrived = other->arrival == Arrival::kArrived;
    const bool lately = other->added_ns && step.frame.stamp_ns - *other->added_ns <= window_ns;
    if (arrived && !(other_arrived && lately)) continue;
    if (connected(found, *other) || share >= kInsideShare) return other;
    if (surroundings_known(found, *other) && sides_of_one(step, found, *other)) return other;
  }
  return nullptr;
}

}  // namespace pocd
