// ObjectTracker: sides of one thing, seen from one place at a time.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// A side that departed went along with a thing that moved: at the new place, at least this share
/// of it is seen, or it was within the thing; at most this share of what is known there is empty.
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
/// Two sides of a body face away from each other along the line between them, by this difference of
/// cosines at least: surfaces that face one way are of two things in a row.
constexpr float kApart = 0.2f;
/// A piece of at most this share of the other one's surface, so many contacts away or nearer, may
/// lie in any direction from it: a fork or a handle is no side that faces away.
constexpr double kFragmentShare = 0.15;
constexpr double kFragmentContacts = 3.0;

bool told_apart(const LibraryObject& a, const LibraryObject& b) {
  const auto apart = [](const LibraryObject& x, const LibraryObject& y) {
    const auto looks = x.companions.find(y.id);
    return looks != x.companions.end() && looks->second == LibraryObject::kToldApart;
  };
  return apart(a, b) || apart(b, a);
}

}  // namespace

std::vector<Surfel> moved_surfels(const std::vector<Surfel>& surfels, const Pose& T_new_old) {
  const Eigen::Isometry3f T = T_new_old.cast<float>();
  std::vector<Surfel> moved = surfels;
  for (Surfel& s : moved) {
    s.point_W = T * s.point_W;
    s.normal_W = T.linear() * s.normal_W;
    s.seen_through = 0;
  }
  return moved;
}

double inside_share(const std::vector<Surfel>& surfels, const OrientedBox& box, double margin_m) {
  std::size_t inside = 0;
  for (const Surfel& s : surfels) inside += is_inside(box, margin_m, s.point_W);
  return static_cast<double>(inside) / static_cast<double>(surfels.size());
}

bool ObjectTracker::sides_of_one(Step& step, const LibraryObject& a, const LibraryObject& b) const {
  if (told_apart(a, b)) return false;
  const auto sample = [](const LibraryObject& object) {
    std::vector<const Surfel*> some;
    const auto& surfels = object.model.surfels();
    const std::size_t stride = std::max<std::size_t>(1, surfels.size() / kGapPoints);
    for (std::size_t i = 0; i < surfels.size(); i += stride) {
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
  const auto smaller = static_cast<double>((a_less ? a : b).model.surfels().size());
  const auto larger = static_cast<double>((a_less ? b : a).model.surfels().size());
  const bool fragment = a.class_id != kThing && smaller <= kFragmentShare * larger &&
                        lines.front().length_m < kFragmentContacts * contact_m();
  const auto cell_m = static_cast<float>(2.0 * config_.map.voxel_size_m);
  std::size_t crossing = 0;
  for (const Line& line : lines) {
    const Eigen::Vector3f along =
        (line.to->point_W - line.from->point_W) / std::max(line.length_m, 1e-6f);
    const float leaves = line.from->normal_W.dot(along), enters = -line.to->normal_W.dot(along);
    const bool aside = std::max(leaves, enters) > kOutside ||
                       (line.length_m > contact_m() && leaves + enters > -kApart);
    bool open = line.length_m > reach_m || (aside && !fragment);
    for (float at = cell_m; !open && at < line.length_m - 0.5f * cell_m; at += 0.5f * cell_m)
      open = seen_empty(step.distance_at, line.from->point_W + at * along);
    crossing += open;
  }
  return static_cast<double>(crossing) <= kGapShare * static_cast<double>(lines.size());
}

void ObjectTracker::join_sides(Step& step) {
  const auto gap_ns = static_cast<StampNs>(config_.state.visit_gap_s * 1e9);
  const ViewBall view = view_ball(step.cloud, config_.map.max_depth_m);
  std::vector<ObjectId> visited, rows_end;
  for (const ObjectId id : library_.near(view.center_W, view.radius_m)) {
    LibraryObject* object = library_.find(id);
    const bool anew = step.frame.stamp_ns - object->in_reach_ns > gap_ns;
    // Of cameras whose every look is a visit, visits in a row count.
    const bool one_look = object->visit_ns == object->in_reach_ns;
    object->in_reach_ns = step.frame.stamp_ns;
    if (!anew) continue;
    object->visit_ns = step.frame.stamp_ns;
    if (!one_look) rows_end.push_back(id);
    // Of what geometry alone tells, looks of one visit count: a post at the edge of view is seen
    // once or twice on each.
    if (!one_look && !object->confirmed && object->class_id == kThing) object->observations = 0;
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
        join(step, *object, *other);
        joined = true;
        break;
      }
    }
  }
  // Looks in a row are of one visit: what was in doubt then is asked anew.
  for (const ObjectId id : rows_end) {
    if (LibraryObject* object = library_.find(id))
      object->looks_unobserved = object->looks_displaced = object->looks_losing = 0;
  }
}

bool ObjectTracker::surroundings_known(const LibraryObject& found,
                                       const LibraryObject& known) const {
  // A thing that arrived may stand beside another that arrived in the same visit.
  if (found.arrival == Arrival::kArrived) return known.visit_ns > known.placed_ns;
  const auto gap_ns = static_cast<StampNs>(config_.state.visit_gap_s * 1e9);
  return found.first_seen_ns - known.placed_ns > gap_ns;
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
  const auto radius = static_cast<float>(config_.map.voxel_size_m);
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  std::vector<Surfel> sides;
  std::vector<int> on_arrival(arrivals.size(), 0);
  int on_moved = 0, seen = 0, empty = 0;
  for (const Surfel& s : moved_surfels(departure.surfels, move.T_new_old)) {
    bool measured = moved->model.nearest(s.point_W, radius) != ObjectModel::kNone;
    on_moved += measured;
    for (std::size_t k = 0; k < arrivals.size(); ++k) {
      if (arrivals[k]->model.nearest(s.point_W, radius) == ObjectModel::kNone) continue;
      ++on_arrival[k];
      measured = true;
    }
    seen += measured;
    if (measured || !seen_empty(step.distance_at, s.point_W)) {
      sides.push_back(s);
    } else {
      ++empty;
    }
  }
  const auto all = static_cast<double>(departure.surfels.size());
  if (empty > kAlongEmptyShare * (seen + empty)) return Along::kNo;
  if (on_moved >= kAlongSeenShare * all ||
      inside_share(departure.surfels, move.from, margin_m) >= kInsideShare) {
    moved->model.add(sides);
    moved->icp_target.reset();
    moved->most_surfels = std::max(moved->most_surfels, moved->model.surfels().size());
    refit_box(step, *moved);
    mark_changed(*moved);
    ObjectEvent& event = add_event(step, EventKind::kUpdated, *moved, Rule::kJoined, departure.id);
    if (departure.part_of == ObjectId::kNone) event.absorbed = departure.id;
    moved->reported_box = moved->box;
    return Along::kJoined;
  }
  const auto most = std::max_element(on_arrival.begin(), on_arrival.end());
  if (most == on_arrival.end() || *most < kAlongSeenShare * all) return Along::kNo;
  report_move(step, *arrivals[most - on_arrival.begin()], departure, move.T_new_old,
              Rule::kMovedAlike);
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
  LibraryObject* moved = library_.find(move.id);
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  for (const ObjectId id :
       library_.near(moved->box.pose.position_W, 0.5 * moved->box.size_m.norm())) {
    LibraryObject* other = library_.find(id);
    if (id == move.id || other->class_id != move.class_id || !other->added_ns ||
        other->first_seen_ns <= move.in_place_ns) {
      continue;
    }
    if (inside_share(other->model.surfels(), moved->box, margin_m) >= kInsideShare)
      absorb(step, *moved, *other);
  }
}

}  // namespace pocd
