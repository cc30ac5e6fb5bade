// What was found gone, kept for a while: a like thing that arrives may be the same.
#pragma once

#include <deque>
#include <functional>
#include <memory>

#include "pocd/objects/object_library.hpp"

namespace pocd {

struct Departure {
  ObjectId id = ObjectId::kNone;
  /// The object that it was a part of, or kNone.
  ObjectId part_of = ObjectId::kNone;
  ClassId class_id = 0;
  OrientedBox box;
  std::vector<Surfel> surfels;
  StampNs first_seen_ns = 0;
  StampNs in_place_ns = 0;    ///< last seen in its place
  StampNs first_gone_ns = 0;  ///< first of the looks in a row that found it gone; 0: not known
  StampNs departed_ns = 0;    ///< found gone; its age is what counts
  Arrival arrival = Arrival::kUnknown;
  std::set<std::string> seen_by;
  Evidence evidence;
  bool asked_far = false;  ///< objects at a distance were asked whether they are it
  ObjectId is_not =
      ObjectId::kNone;  ///< the last object that was taken for it and is another thing
};

/// How a thing went from its old place to the new one.
struct Motion {
  Pose T_new_old = Pose::Identity();
  double fit = 0.0;          ///< of what is known at the new place, the share that agrees
  bool fits_surely = false;  ///< nearly all of the new surface has a place on the old body
  double seen = 0.0;         ///< share of the old surface that is seen at the new place
  double lengths = 0.0;      ///< of its way (mean over its points), in its own lengths
  /// Share of the surface that a motion must explain more when it is longer by the thing's length.
  static constexpr double kShortness = 0.4;
  /// Orders motions. Of those that explain the same, the shortest comes first: the sides of a box
  /// are alike.
  double likelihood() const { return fit + seen - kShortness * lengths; }
};

/// A thing that was found at a new place.
struct Move {
  ObjectId id = ObjectId::kNone;
  ClassId class_id = 0;
  OrientedBox from;  ///< where all that is known of it was
  Pose T_new_old = Pose::Identity();
  StampNs in_place_ns = 0;  ///< last seen at its old place
  StampNs moved_ns = 0;     ///< found at the new one; as Departure::departed_ns
  /// What left the old place, and when the first of it was seen at the new one; null of what was
  /// seen beside its place all the time.
  std::shared_ptr<const Departure> left;
  StampNs first_seen_there_ns = 0;
  std::size_t surfels_there = 0;  ///< measured there when it was asked last whether it moved
};

/// Departures and moves within a window of time, oldest first. Not thread-safe.
class Departures {
 public:
  /// Of each of the two: whatever the stamps are, no more are kept. A site has a few at a time;
  /// each is compared with all that arrives, and written with every step of a memory.
  static constexpr std::size_t kMost = 500;

  /// These two return false when the oldest had to go for the new one.
  bool add(Departure departure);
  /// Those within `window_s` before `now_ns`; older ones are forgotten. Valid until the next call.
  const std::deque<Departure>& recent(StampNs now_ns, double window_s);
  bool has(ObjectId id) const;
  void forget(ObjectId id);
  /// Those whose box has its middle [m, W] where `inside` accepts it.
  void forget_where(const std::function<bool(const Eigen::Vector2d&)>& inside);
  void set_asked_far(ObjectId id);
  bool add_move(const Move& move);
  /// As recent().
  const std::deque<Move>& recent_moves(StampNs now_ns, double window_s);
  /// The last one of the object, or null. Valid until the next call.
  Move* last_move_of(ObjectId id);
  void forget_moves_of(ObjectId id);
  /// The clock that was at `newest_ns` goes on from `latest_ns`: nothing that is kept happened
  /// later, and all of it stays as old as it is. A replay that starts again and again would keep
  /// it for ever otherwise.
  void set_clock_back(StampNs newest_ns, StampNs latest_ns);

 private:
  friend struct ArchiveAccess;
  std::deque<Departure> list_;
  std::deque<Move> moves_;
};

}  // namespace pocd
