// Which robots are on the bus: those whose depth images are announced.
#pragma once

#include <chrono>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "pocd/config/node_config.hpp"
#include "pocd_dds/entities/bus_watch.hpp"

namespace pocd::dds {

/// A robot that came (no reason) or has gone (why).
struct RosterChange {
  std::string robot;
  bool present = false;
  std::string reason;
};

/// Of a participant that dies, Fast DDS takes back the writers first and then says why: so long the
/// reason of a departure is waited for.
inline constexpr std::chrono::milliseconds kReasonWait{300};

/// Robots that the configuration names, and, if it says so, everybody whose depth topic fits the
/// pattern. Not thread-safe.
class Roster {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Roster(const NodeConfig& node);

  /// What the event changes.
  std::vector<RosterChange> hear(const BusEvent& event, Clock::time_point now);
  /// Departures whose reason has been waited for long enough.
  std::vector<RosterChange> settle(Clock::time_point now);

 private:
  struct Writer {
    std::string robot;
    ParticipantKey participant;
  };
  /// "" when the topic is no robot's.
  std::string robot_of(const std::string& topic) const;
  /// True when the robot of this writer has no other.
  bool drop(const EndpointKey& key, std::string& robot);

  const bool discovers_;
  const std::string pattern_;
  std::map<std::string, std::string> named_;  // robot by depth topic
  std::set<std::string> names_;               // of named_
  std::map<EndpointKey, Writer> writers_;     // of depth images
  std::map<std::string, int> writers_of_;     // by robot

  struct Leaving {
    ParticipantKey participant;
    Clock::time_point since;
  };
  std::map<std::string, Leaving> leaving_;  // by robot: its last writer was taken back
};

}  // namespace pocd::dds
