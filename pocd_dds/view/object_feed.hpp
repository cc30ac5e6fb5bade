// Objects and events as they come, with their past and what a restart has left open.
#pragma once

#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
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
      5000;                                        ///< objects that went, kept for slow clients
  static constexpr std::size_t kMostPoses = 2048;  ///< of a robot; older ones are thinned

  explicit ObjectFeed(Board& board) : board_(board) {}

  void object(const WatchedObject& object);
  /// An object of a run that was replaced stays, as unknown, until one of the new run stands there.
  void gone(const WatchedObject& object, Gone why);
  void event(const pocd_msgs::msg::ObjectEvent& message);
  /// An event of the log, from before; one that was heard already counts once.
  void logged(const pocd_msgs::msg::ObjectEvent& message);
  void robot(const RobotPose& pose);

  /// A run of the publisher goes on with what `lineage` is; 0: with nothing.
  void know_run(std::uint64_t epoch, std::uint64_t lineage);
  /// 1, 2, ... for the first, second, ... lineage heard of, of which owners of surfaces are
  /// numbers; 0 for a run that was not heard of.
  std::uint32_t run_of(std::uint64_t epoch) const;
  /// First and last stamp heard of [s]; nothing before the first.
  std::optional<std::pair<double, double>> time_range() const;
  std::size_t unknown() const;
  std::optional<std::string> history(const std::string& uuid) const;
  /// `map`: whether the map of that time is known, too.
  std::string then(StampNs stamp_ns, bool map) const;

 private:
  std::uint32_t run_of_locked(std::uint64_t epoch, std::uint64_t lineage);
  void heard(StampNs stamp_ns);
  void say_gone(const WatchedObject& object, const std::string& why);
  bool say_event(const pocd_msgs::msg::ObjectEvent& message);
  Json robots_then(StampNs stamp_ns) const;

  Board& board_;
  mutable std::mutex mutex_;
  History history_;
  std::map<std::uint64_t, std::uint64_t> lineages_;           // by epoch
  std::map<std::uint64_t, std::uint32_t> runs_;               // by lineage
  std::map<std::string, WatchedObject> unknown_;              // of replaced runs, by uuid
  using EventName = std::pair<std::uint64_t, std::uint64_t>;  // lineage, number in it
  std::set<EventName> known_events_;
  std::deque<std::pair<std::string, EventName>> events_;  // keys on the board
  std::deque<std::string> departures_;                    // the same
  std::map<std::string, std::deque<RobotPose>> poses_;    // by stamp, a robot's never empty
  std::uint64_t event_count_ = 0;
  std::optional<StampNs> first_ns_, last_ns_;
};

}  // namespace pocd::view
