#include "pocd/track/departures.hpp"

#include <algorithm>
#include <utility>

namespace pocd {

bool Departures::add(Departure departure) {
  list_.push_back(std::move(departure));
  if (list_.size() <= kMost) return true;
  list_.pop_front();
  return false;
}

bool Departures::add_move(const Move& move) {
  moves_.push_back(move);
  if (moves_.size() <= kMost) return true;
  moves_.pop_front();
  return false;
}

const std::deque<Departure>& Departures::recent(StampNs now_ns, double window_s) {
  const auto window_ns = static_cast<StampNs>(window_s * 1e9);
  while (!list_.empty() && now_ns - list_.front().departed_ns > window_ns) list_.pop_front();
  return list_;
}

const std::deque<Move>& Departures::recent_moves(StampNs now_ns, double window_s) {
  const auto window_ns = static_cast<StampNs>(window_s * 1e9);
  while (!moves_.empty() && now_ns - moves_.front().moved_ns > window_ns) moves_.pop_front();
  return moves_;
}

Move* Departures::last_move_of(ObjectId id) {
  const auto last =
      std::find_if(moves_.rbegin(), moves_.rend(), [&](const Move& m) { return m.id == id; });
  return last == moves_.rend() ? nullptr : &*last;
}

void Departures::forget_moves_of(ObjectId id) {
  moves_.erase(
      std::remove_if(moves_.begin(), moves_.end(), [&](const Move& m) { return m.id == id; }),
      moves_.end());
}

bool Departures::has(ObjectId id) const {
  return std::any_of(list_.begin(), list_.end(), [&](const Departure& d) { return d.id == id; });
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
  moves_.erase(
      std::remove_if(moves_.begin(), moves_.end(),
                     [&](const Move& m) { return inside(m.from.pose.position_W.head<2>()); }),
      moves_.end());
}

void Departures::set_asked_far(ObjectId id) {
  for (Departure& d : list_) d.asked_far |= d.id == id;
}

void Departures::set_clock_back(StampNs newest_ns, StampNs latest_ns) {
  const StampNs back_ns = newest_ns - latest_ns;
  const auto set_back = [&](Departure& d) {
    for (StampNs* stamp_ns : {&d.first_seen_ns, &d.in_place_ns, &d.first_gone_ns})
      *stamp_ns = std::min(*stamp_ns, latest_ns);
    d.departed_ns -= back_ns;
  };
  for (Departure& d : list_) set_back(d);
  for (Move& m : moves_) {
    m.in_place_ns = std::min(m.in_place_ns, latest_ns);
    m.first_seen_there_ns = std::min(m.first_seen_there_ns, latest_ns);
    m.moved_ns -= back_ns;
    if (!m.left) continue;
    Departure left = *m.left;
    set_back(left);
    m.left = std::make_shared<const Departure>(std::move(left));
  }
}

}  // namespace pocd
