#include "pocd/track/departures.hpp"

#include <algorithm>

namespace pocd {

const std::deque<Departure>& Departures::recent(StampNs now_ns, double window_s) {
  const auto window_ns = static_cast<StampNs>(window_s * 1e9);
  while (!list_.empty() && now_ns - list_.front().departed_ns > window_ns) list_.pop_front();
  return list_;
}

void Departures::forget(ObjectId id) {
  list_.erase(
      std::remove_if(list_.begin(), list_.end(), [&](const Departure& d) { return d.id == id; }),
      list_.end());
}

void Departures::forget_where(const std::function<bool(const Eigen::Vector2d&)>& inside) {
  list_.erase(
      std::remove_if(list_.begin(), list_.end(),
                     [&](const Departure& d) { return inside(d.box.pose.position_W.head<2>()); }),
      list_.end());
}

void Departures::set_asked_far(ObjectId id) {
  for (Departure& d : list_) d.asked_far |= d.id == id;
}

void Departures::set_clock_back(StampNs latest_ns) {
  for (Departure& d : list_) {
    for (StampNs* stamp_ns : {&d.first_seen_ns, &d.in_place_ns, &d.first_gone_ns, &d.departed_ns})
      *stamp_ns = std::min(*stamp_ns, latest_ns);
  }
}

}  // namespace pocd
