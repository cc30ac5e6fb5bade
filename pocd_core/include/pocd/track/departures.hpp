// What was found gone, kept for a while: a like thing that arrives may be the same.
#pragma once

#include <deque>
#include <functional>

#include "pocd/map/object_library.hpp"

namespace pocd {

struct Departure {
  ObjectId id = ObjectId::kNone;
  /// The object that it was a part of, or kNone.
  ObjectId part_of = ObjectId::kNone;
  ClassId class_id = 0;
  OrientedBox box;
  std::vector<Surfel> surfels;
  StampNs first_seen_ns = 0;
  StampNs in_place_ns = 0;  ///< last seen in its place
  StampNs first_gone_ns = 0;  ///< first of the looks in a row that found it gone; 0: not known
  StampNs departed_ns = 0;    ///< found gone
  std::set<std::string> seen_by;
  Evidence evidence;
  bool asked_far = false;  ///< objects at a distance were asked whether they are it
};

/// How a thing went from its old place to the new one.
struct Motion {
  Pose T_new_old = Pose::Identity();
  double length_m = 0.0;  ///< mean over its points
};

/// Departures within a window of time, oldest first. Not thread-safe.
class Departures {
 public:
  void add(Departure departure) { list_.push_back(std::move(departure)); }
  /// Those within `window_s` before `now_ns`; older ones are forgotten. Valid until the next call.
  const std::deque<Departure>& recent(StampNs now_ns, double window_s);
  void forget(ObjectId id);
  /// Those whose box has its middle [m, W] where `inside` accepts it.
  void forget_where(const std::function<bool(const Eigen::Vector2d&)>& inside);
  void set_asked_far(ObjectId id);
  /// Nothing that is kept happened after `latest_ns`.
  void set_clock_back(StampNs latest_ns);

 private:
  friend struct ArchiveAccess;
  std::deque<Departure> list_;
};

}  // namespace pocd
