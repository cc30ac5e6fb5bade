// ObjectTracker: which objects are one thing, and how they are joined.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include "tracker_step.hpp"

namespace pocd {
namespace {

/// Two objects are seen in one piece when this many points of each are measured on it.
constexpr int kSharedPoints = 10;
/// From this share within another one's box on, an object is a side of it, whether it was found or
/// arrived: no other thing stands within a thing.
constexpr double kWithinShare = 0.9;
/// Two objects are one when this share of the smaller one lies on the other.
constexpr double kSameShare = 0.5;
/// Surfels of each object of which it is asked whether they lie before the other one.
constexpr std::size_t kCornerPoints = 60;

}  // namespace

std::vector<const Surfel*> some_surfels(const std::vector<Surfel>& surfels,
                                        const std::vector<std::uint8_t>& marked,
                                        std::size_t about) {
  const auto count = static_cast<std::size_t>(std::count(marked.begin(), marked.end(), 1));
  const std::size_t step = std::max<std::size_t>(1, count / about);
  std::vector<const Surfel*> some;
  for (std::size_t i = 0, nth = 0; i < surfels.size(); ++i) {
    if (marked[i] && nth++ % step == 0) some.push_back(&surfels[i]);
  }
  return some;
}

bool is_before(const std::vector<const Surfel*>& surface, const Eigen::Vector3f& point_W,
               double before_m) {
  const auto of = std::count_if(surface.begin(), surface.end(), [&](const Surfel* s) {
    return s->normal_W.dot(point_W - s->point_W) > static_cast<float>(before_m);
  });
  return 2 * static_cast<std::size_t>(of) > surface.size();
}

bool lie_before(const std::vector<const Surfel*>& points, const std::vector<const Surfel*>& surface,
                double before_m) {
  const auto before = std::count_if(points.begin(), points.end(), [&](const Surfel* s) {
    return is_before(surface, s->point_W, before_m);
  });
  return 2 * static_cast<std::size_t>(before) > points.size();
}

bool ObjectTracker::may_be_one(const LibraryObject& a, const LibraryObject& b) const {
  // Two things that moved, each as a whole, are two; what arrived is no side of what stood there.
  if (a.moved && b.moved) return false;
  const bool a_arrived = a.arrival == Arrival::kArrived, b_arrived = b.arrival == Arrival::kArrived;
  return a_arrived == b_arrived;
}

bool ObjectTracker::form_corner(const LibraryObject& a, const LibraryObject& b) const {
  const auto some_of = [](const LibraryObject& object) {
    const auto& surfels = object.model.surfels();
    return some_surfels(surfels, std::vector<std::uint8_t>(surfels.size(), 1), kCornerPoints);
  };
  const auto of_a = some_of(a), of_b = some_of(b);
  const double before_m = 2.0 * contact_m();
  return lie_before(of_a, of_b, before_m) && lie_before(of_b, of_a, before_m);
}

void ObjectTracker::forget_gone_companions(LibraryObject& object) {
  for (auto at = object.companions.begin(); at != object.companions.end();) {
    // What departed lately may be found again.
    const bool there = std::as_const(library_).find(at->first) || departures_.has(at->first);
    at = there ? std::next(at) : object.companions.erase(at);
  }
}

bool ObjectTracker::connected(const LibraryObject& a, const LibraryObject& b) const {
  if (form_corner(a, b)) return false;
  const bool a_less = a.model.surfels().size() < b.model.surfels().size();
  const LibraryObject& small = a_less ? a : b;
  const LibraryObject& large = a_less ? b : a;
  int contacts = 0, checked = 0;
  for (const Surfel& s : small.model.surfels()) {
    if (s.hits < 2 || s.seen_through > 0) continue;
    ++checked;
    const int other = large.model.nearest(s.point_W, static_cast<float>(contact_m()));
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

bool ObjectTracker::carries(const LibraryObject& low, const LibraryObject& high) const {
  if (low.class_id == kThing) return false;
  const double bottom_m = high.box.pose.position_W.z() - 0.5 * high.box.size_m.z();
  const double middle_m = low.box.pose.position_W.z();
  const double top_m = middle_m + 0.5 * low.box.size_m.z();
  if (bottom_m < middle_m || bottom_m > top_m + contact_m()) return false;
  OrientedBox column = low.box;
  column.size_m.z() = std::numeric_limits<double>::infinity();
  const double margin_m = 2.0 * config_.map.voxel_size_m;
  return inside_share(high.model.surfels(), column, margin_m) >= kInsideShare;
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
      // Things that come and go beside one that stays would be listed without end.
      if ((apart || one_piece) && x.companions.count(y.id) == 0) forget_gone_companions(x);
      if (apart) {
        x.companions[y.id] = LibraryObject::kToldApart;
        continue;
      }
      const auto count = x.companions.find(y.id);
      if (!one_piece) {
        // Once seen as two, they have to be seen as one for as long again.
        const bool both =
            look_a.sighting.hit >= kSharedPoints && look_b.sighting.hit >= kSharedPoints;
        if (both && count != x.companions.end() && count->second > 0 && --count->second == 0)
          x.companions.erase(count);
        continue;
      }
      if (coincide(x, y)) {
        joined.emplace_back(x.id, y.id);
        continue;
      }
      int& looks = x.companions[y.id];
      looks = std::max(looks, 0) + 1;
      if (looks < enough) continue;
      looks = 0;
      if (connected(x, y)) joined.emplace_back(x.id, y.id);
    }
  }
  for (const auto& [a, b] : joined) {
    LibraryObject *x = library_.find(a), *y = library_.find(b);
    if (x && y) join(step, *x, *y);
  }
}

void ObjectTracker::join(Step& step, LibraryObject& a, LibraryObject& b) {
  // What is known outside goes on; of two such, the one that was reported first: a candidate may be
  // older than its report. What moved was known before it did.
  const auto since = [](const LibraryObject& object) {
    const StampNs reported_ns = object.added_ns.value_or(std::numeric_limits<StampNs>::min());
    return std::make_tuple(!object.confirmed, reported_ns, object.id);
  };
  const bool first = since(a) < since(b);
  absorb(step, first ? a : b, first ? b : a);
}

void ObjectTracker::absorb(Step& step, LibraryObject& survivor, LibraryObject& absorbed) {
  const ObjectId absorbed_id = absorbed.id;
  const bool was_known = absorbed.confirmed;
  survivor.model.absorb(absorbed.model);
  survivor.icp_target.reset();
  survivor.most_surfels = std::max(survivor.most_surfels, survivor.model.surfels().size());
  // Both were seen in the same looks, for the most part.
  survivor.observations = std::max(survivor.observations, absorbed.observations);
  for (const std::string& robot : absorbed.seen_by) survivor.note_seer(robot);
  // What arrived is no side of what stood there: all of it arrived.
  if (survivor.arrival == Arrival::kUnknown && absorbed.arrival == Arrival::kArrived)
    survivor.arrival = Arrival::kArrived;
  survivor.in_place_ns = std::max(survivor.in_place_ns, absorbed.in_place_ns);
  survivor.last_seen_ns = std::max(survivor.last_seen_ns, absorbed.last_seen_ns);
  survivor.companions.clear();
  mark_changed(survivor);
  step.edits.reassign(absorbed_id, survivor.id);
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
  add_event(step, EventKind::kUpdated, survivor, Rule::kJoined, absorbed_id).absorbed = absorbed_id;
  survivor.reported_box = survivor.box;
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
    const double share = inside_share(found.model.surfels(), other->box, margin_m);
    if (share >= kWithinShare) return other;
    // What arrived is a side of what arrived lately; what was found, of what stands longer, too.
    const bool other_arrived = other->arrival == Arrival::kArrived;
    const bool lately = other->added_ns && step.frame.stamp_ns - *other->added_ns <= window_ns;
    if (arrived && !(other_arrived && lately)) continue;
    if (connected(found, *other) || share >= kInsideShare) return other;
    if (carries(*other, found) || carries(found, *other)) return other;
    if (surroundings_known(found, *other) && sides_of_one(step, found, *other)) return other;
  }
  return nullptr;
}

LibraryObject* ObjectTracker::grown_onto(Step& step, const LibraryObject& object) {
  // Without a class, what touches may be two things: they have to be seen as one for long.
  if (object.class_id == kThing) return nullptr;
  const auto window_ns = static_cast<StampNs>(config_.state.relocation_window_s * 1e9);
  if (!object.added_ns || step.frame.stamp_ns - *object.added_ns > window_ns) return nullptr;
  LibraryObject* whole = whole_of(step, object);
  if (!whole || may_be_one(object, *whole)) return whole;
  // Of one visit, whether they arrived is told of what was seen of each.
  const auto gap_ns = static_cast<StampNs>(config_.state.visit_gap_s * 1e9);
  return std::abs(object.first_seen_ns - whole->first_seen_ns) <= gap_ns ? whole : nullptr;
}

}  // namespace pocd
