// Puts the frames of several robots into one order that does not depend on when they arrived.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "pocd/common/types.hpp"

namespace pocd {

/// Order: by stamp, then by the robot's name. A frame comes out once every live robot's watermark
/// has reached its stamp; a robot that lags behind the newest frame by more than `max_wait_ns` of
/// data time is not waited for until it has caught up. Not thread-safe.
template <class Item>
class FrameMerger {
 public:
  /// Without `max_wait_ns`: waits for as long as the robot is live.
  explicit FrameMerger(std::optional<StampNs> max_wait_ns) : max_wait_ns_(max_wait_ns) {}

  /// A live robot is waited for. A robot that is new or has gone needs saying so.
  void set_live(const std::string& robot, bool live) {
    Robot& entry = robots_[robot];
    entry.live = live;
    if (live) entry.leaving = false;
  }
  /// The robot has gone for good: its frames still come out, then nothing of it is left.
  void forget(const std::string& robot) {
    const auto found = robots_.find(robot);
    if (found == robots_.end()) return;
    found->second.live = false;
    found->second.leaving = true;
    if (found->second.items.empty()) robots_.erase(found);
  }
  bool knows(const std::string& robot) const { return robots_.count(robot) > 0; }

  void add(const std::string& robot, StampNs stamp_ns, Item item) {
    Robot& entry = robots_[robot];
    // A robot whose stamps start anew: what waits goes first and holds nothing up.
    if (stamp_ns < entry.newest_ns) {
      for (auto& waiting : entry.items) waiting.first = std::min(waiting.first, stamp_ns);
    }
    entry.items.emplace_back(stamp_ns, std::move(item));
    entry.newest_ns = stamp_ns;
  }
  /// No frame of the robot at or before this stamp will be added any more.
  void set_watermark(const std::string& robot, StampNs stamp_ns) {
    robots_[robot].watermark_ns = stamp_ns;
  }

  /// The next frame in order, or nothing while a live robot could still add an earlier one.
  std::optional<Item> take(bool last_call = false) {
    auto first = robots_.end();
    StampNs newest_ns = std::numeric_limits<StampNs>::min();
    for (auto it = robots_.begin(); it != robots_.end(); ++it) {
      // A robot that has gone takes its clock along.
      if (it->second.live || !it->second.items.empty()) {
        newest_ns = std::max(newest_ns, it->second.newest_ns);
      }
      if (it->second.items.empty()) continue;
      // The order of the map breaks ties of stamps by name.
      if (first == robots_.end() ||
          it->second.items.front().first < first->second.items.front().first) {
        first = it;
      }
    }
    waits_for_.clear();
    if (first == robots_.end()) return std::nullopt;
    const StampNs stamp_ns = first->second.items.front().first;
    for (const auto& [name, robot] : robots_) {
      if (last_call || !robot.live || robot.watermark_ns >= stamp_ns) continue;
      if (max_wait_ns_ && newest_ns - stamp_ns > *max_wait_ns_) continue;
      waits_for_ = name;
      return std::nullopt;
    }
    Item item = std::move(first->second.items.front().second);
    first->second.items.pop_front();
    if (first->second.leaving && first->second.items.empty()) robots_.erase(first);
    return item;
  }

  std::size_t pending(const std::string& robot) const {
    const auto found = robots_.find(robot);
    return found == robots_.end() ? 0 : found->second.items.size();
  }
  /// Robot that the last take() waited for; "" when it did not wait.
  const std::string& waits_for() const { return waits_for_; }

 private:
  struct Robot {
    std::deque<std::pair<StampNs, Item>> items;
    StampNs watermark_ns = std::numeric_limits<StampNs>::min();
    StampNs newest_ns = std::numeric_limits<StampNs>::min();
    bool live = false;
    bool leaving = false;
  };
  std::optional<StampNs> max_wait_ns_;
  std::map<std::string, Robot> robots_;
  std::string waits_for_;
};

}  // namespace pocd
