// Archive of one object of the library: everything that a later frame may ask of it.
#pragma once

#include "archive_basics.hpp"
#include "pocd/map/object_library.hpp"

namespace pocd {

template <class Archive>
void archive(Archive& a, Surfel& s) {
  a(s.point_W, s.normal_W, s.weight, s.hits, s.seen_through);
}

template <class Archive>
void archive(Archive& a, Moment& m) {
  a(m.start_ns, m.frame_ns, m.robots, m.before, m.measured, m.observed, m.seen_through, m.points);
}

/// But for its id, which is the key of the piece, and for icp_target, which is made of the model.
template <class Archive>
void archive(Archive& a, LibraryObject& o) {
  a.version(1);
  a(o.class_id, o.stationarity_class, o.confirmed, o.model, o.box, o.centroid_W, o.belief);
  a(o.first_seen_ns, o.last_seen_ns, o.verified_ns, o.contested_ns, o.contested_since_ns);
  a(o.arrived, o.last_robot, o.seen_by, o.moment, o.observations);
  a(o.frames_in_view, o.frames_seen_through, o.frames_displaced, o.frames_odd);
  a(o.reported_box, o.expected_box, o.grew_ns, o.box_before_growth, o.growing, o.cut, o.cut_above);
  a(o.gained, o.eroded, o.returned, o.added_ns, o.moved_from, o.changed);
  a(o.box_surfels, o.most_surfels, o.companions);
}

#if defined(__x86_64__) && defined(__GLIBCXX__)
static_assert(sizeof(LibraryObject) == 776 && sizeof(Moment) == 80 && sizeof(Surfel) == 32,
              "a field came or went: describe it above, and change kPiecesVersion");
#endif

}  // namespace pocd
