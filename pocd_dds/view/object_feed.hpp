// Objects and events as they come, with their past and what a restart has left open.
#pragma once

#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "view/board.hpp"
#include "view/history.hpp"
#include "view/json_text.hpp"

namespace pocd::view {

/// Thread-safe.
class ObjectFeed {
 public:
  static constexpr std::size_t kMostEvents = 5000;  ///< kept for the event list
  static constexpr std::size_t kMostDepartures =
      5000;  ///< objects that went, kept for slow clients

  explicit ObjectFeed(Board& board) : board_(board) {}

  void object(const WatchedObject& object);
  /// An object of a run that was replaced stays, as unknown, until one of the new run stands there.
  void gone(const WatchedObject& object, Gone why);
  void event(const pocd_msgs::msg::ObjectEvent& message);

  /// 1, 2, ... in the order in which runs were heard of; 0 for no run.
  std::uint32_t run_of(std::uint64_t epoch);
  /// First and last stamp heard of [s]; nothing before the first.
  std::optional<std::pair<double, double>> time_range() const;
  std::size_t unknown() const;
  std::optional<std::string> history(const std::string& uuid) const;
  std::string then(StampNs stamp_ns) const;

 private:
  std::uint32_t run_of_locked(std::uint64_t epoch);
  void heard(StampNs stamp_ns);
  void say_gone(const WatchedObject& object, const std::string& why);

  Board& board_;
  mutable std::mutex mutex_;
  History history_;
  std::map<std::uint64_t, std::uint32_t> runs_;
  std::map<std::string, WatchedObject> unknown_;  // of replaced runs, by uuid
  std::deque<std::string> events_, departures_;   // keys on the board
  std::uint64_t event_count_ = 0;
  std::optional<StampNs> first_ns_, last_ns_;
};

}  // namespace pocd::view
