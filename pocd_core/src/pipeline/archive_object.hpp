// Archive of one object of the library: everything that a later frame may ask of it.
#pragma once

#include "archive_basics.hpp"
#include "pocd/map/object_library.hpp"
#include "pocd/track/departures.hpp"

namespace pocd {

template <class Archive>
void archive(Archive& a, Surfel& s) {
  a(s.point_W, s.normal_W, s.weight, s.hits, s.seen_through, s.arrived, s.last_hit_ns);
}

template <class Archive>
void archive(Archive& a, Moment& m) {
  a(m.start_ns, m.frame_ns, m.robots, m.before, m.measured, m.observed, m.seen_through, m.points);
}

/// But for its id, which is the key of the piece, and for icp_target, which is made of the model.
template <class Archive>
void archive(Archive& a, LibraryObject& o) {
  a.version(1);
  a(o.class_id, o.stationarity_class, o.model, o.box, o.centroid_W, o.belief, o.arrival, o.moved);
  a(o.first_seen_ns, o.last_seen_ns, o.in_place_ns, o.last_robot, o.seen_by, o.moment);
  a(o.observations, o.confirmed, o.added_ns, o.reported_box, o.changed);
  a(o.looks_missed, o.looks_unobserved, o.unobserved_since_ns, o.looks_displaced, o.looks_losing);
  a(o.lost, o.companions, o.box_surfels, o.most_surfels);
}

template <class Archive>
void archive(Archive& a, Departure& d) {
  a(d.id, d.part_of, d.class_id, d.box, d.surfels, d.first_seen_ns, d.in_place_ns, d.departed_ns,
    d.seen_by, d.evidence, d.asked_far);
}

#if defined(__x86_64__) && defined(__GLIBCXX__)
static_assert(sizeof(LibraryObject) == 616 && sizeof(Moment) == 80 && sizeof(Surfel) == 40 &&
                  sizeof(Departure) == 328,
              "a field came or went: describe it above, and change kPiecesVersion");
#endif

}  // namespace pocd
