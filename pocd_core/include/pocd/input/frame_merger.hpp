// Puts the frames of several robots into one order that does not depend on when they arrived.
#pragma once

#include <cstddef>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "pocd/common/types.hpp"

namespace pocd {

/// Order: by stamp, then by the robot's name. A frame comes out once every live robot's watermark has
/// reached its stamp; a robot that lags behind the newest frame by more than `max_wait_ns` of data time
/// is not waited for until it has caught up. Not thread-safe.
template <class Item>
class FrameMerger {
 public:
  /// Without `max_wait_ns`: waits for as long as the robot is live.
  explicit FrameMerger(std::optional<StampNs> max_wait_ns) : max_wait_ns_(max_wait_ns) {}

  /// A live robot is waited for. A robot that is new or has gone needs saying so.
  void set_live(const std::string& robot, bool live) { robots_[robot].live = live; }

  void add(const std::string& robot, StampNs stamp_ns, Item item) {
    robots_[robot].items.emplace_back(stamp_ns, std::move(item));
    if (stamp_ns > newest_ns_) newest_ns_ = stamp_ns;
  }
  /// No frame of the robot at or before this stamp will be added any more.
  void set_watermark(const std::string& robot, StampNs stamp_ns) {
    robots_[robot].watermark_ns = stamp_ns;
  }

  /// The next frame in order, or nothing while a live robot could still add an earlier one.
  std::optional<Item> take(bool last_call = false) {
    Robot* first = nullptr;
    for (auto& [name, robot] : robots_) {  // map order breaks ties of stamps by name
      if (robot.items.empty()) continue;
      if (first == nullptr || robot.items.front().first < first->items.front().first) {
        first = &robot;
      }
    }
    waits_for_.clear();
    if (first == nullptr) return std::nullopt;
    const StampNs stamp_ns = first->items.front().first;
    for (const auto& [name, robot] : robots_) {
      if (last_call || !robot.live || robot.watermark_ns >= stamp_ns) continue;
      if (max_wait_ns_ && newest_ns_ - stamp_ns > *max_wait_ns_) continue;
      waits_for_ = name;
      return std::nullopt;
    }
    Item item = std::move(first->items.front().second);
    first->items.pop_front();
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
    bool live = false;
  };
  std::optional<StampNs> max_wait_ns_;
  std::map<std::string, Robot> robots_;
  StampNs newest_ns_ = std::numeric_limits<StampNs>::min();
  std::string waits_for_;
};

}  // namespace pocd
