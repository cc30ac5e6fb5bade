// Archive of one object of the library: everything that a later frame may ask of it.
#pragma once

#include "archive_basics.hpp"
#include "pocd/map/object_library.hpp"
#include "pocd/track/departures.hpp"

namespace pocd {

// Each names all members: one that is added does not compile until it is described. Who changes
// one changes kPiecesVersion.

template <class Archive>
void archive(Archive& a, Surfel& surfel) {
  auto& [point_W, normal_W, weight, hits, seen_through, arrived, last_hit_ns] = surfel;
  a(point_W, normal_W, weight, hits, seen_through, arrived, last_hit_ns);
}

template <class Archive>
void archive(Archive& a, Moment& moment) {
  auto& [start_ns, frame_ns, robots, before, measured, observed, seen_through, points] = moment;
  a(start_ns, frame_ns, robots, before, measured, observed, seen_through, points);
}

/// But for its id, which is the key of the piece, and the alignment target, which is made of the
/// model.
template <class Archive>
void archive(Archive& a, LibraryObject& object) {
  auto& [id, class_id, stationarity_class, model, box, centroid_W, belief, arrival, moved,
         first_seen_ns, last_seen_ns, in_reach_ns, visit_ns, placed_ns, in_place_ns, last_robot,
         seen_by, moment, observations, confirmed, added_ns, reported_box, changed, looks_missed,
         looks_unobserved, unobserved_since_ns, looks_displaced, looks_losing, lost, companions,
         box_surfels, most_surfels, most_free, icp_target] = object;
  a.version(1);
  a(class_id, stationarity_class, model, box, centroid_W, belief, arrival, moved);
  a(first_seen_ns, last_seen_ns, in_reach_ns, visit_ns, placed_ns, in_place_ns);
  a(last_robot, seen_by, moment, observations);
  a(confirmed, added_ns, reported_box, changed, looks_missed, looks_unobserved);
  a(unobserved_since_ns, looks_displaced, looks_losing, lost, companions, box_surfels);
  a(most_surfels, most_free);
}

template <class Archive>
void archive(Archive& a, Departure& departure) {
  auto& [id, part_of, class_id, box, surfels, first_seen_ns, in_place_ns, first_gone_ns,
         departed_ns, arrival, seen_by, evidence, asked_far] = departure;
  a(id, part_of, class_id, box, surfels, first_seen_ns, in_place_ns, first_gone_ns, departed_ns,
    arrival, seen_by, evidence, asked_far);
}

template <class Archive>
void archive(Archive& a, Move& move) {
  auto& [id, class_id, from, T_new_old, in_place_ns, moved_ns] = move;
  a(id, class_id, from, T_new_old, in_place_ns, moved_ns);
}

}  // namespace pocd
