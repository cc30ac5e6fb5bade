#include "pocd_dds/node/roster.hpp"

#include <cstdio>
#include <utility>

#include "pocd_dds/node/input_delivery.hpp"

namespace pocd::dds {
namespace {

constexpr const char* kTakenBack = "its depth images are no longer announced";

std::string lease_text(double lease_s) {
  char text[64];
  std::snprintf(text, sizeof(text), "no sign of life for its lease of %.3g s", lease_s);
  return text;
}

}  // namespace

Roster::Roster(const NodeConfig& node)
    : discovers_(node.discovers()), pattern_(bus_name(node.topics.depth)) {
  for (const RobotConfig& robot : node.robots) {
    named_[topic_of(node, robot, InputStream::kDepth)] = robot.name;
    names_.insert(robot.name);
  }
}

std::string Roster::robot_of(const std::string& topic) const {
  const auto named = named_.find(topic);
  if (named != named_.end()) return named->second;
  if (!discovers_) return "";
  const std::string name = robot_in(pattern_, topic).value_or("");
  // A named robot whose images come on another topic.
  return names_.count(name) > 0 ? "" : name;
}

bool Roster::drop(const EndpointKey& key, std::string& robot) {
  const auto writer = writers_.find(key);
  if (writer == writers_.end()) return false;
  robot = writer->second.robot;
  writers_.erase(writer);
  if (--writers_of_[robot] > 0) return false;
  writers_of_.erase(robot);
  return true;
}

std::vector<RosterChange> Roster::settle(Clock::time_point now) {
  std::vector<RosterChange> changes;
  for (auto it = leaving_.begin(); it != leaving_.end();) {
    if (now - it->second.since < kReasonWait) {
      ++it;
      continue;
    }
    changes.push_back({it->first, false, kTakenBack});
    it = leaving_.erase(it);
  }
  return changes;
}

std::vector<RosterChange> Roster::hear(const BusEvent& event, Clock::time_point now) {
  std::vector<RosterChange> changes;
  switch (event.kind) {
    case BusEvent::Kind::kEndpoint: {
      const BusEndpoint& endpoint = event.endpoint;
      if (!endpoint.writer) break;
      const std::string robot = robot_of(endpoint.topic);
      if (robot.empty()) break;
      if (endpoint.type != spec_of(InputStream::kDepth, endpoint.topic).type) break;
      if (!writers_.emplace(endpoint.key, Writer{robot, event.participant}).second) break;
      if (leaving_.erase(robot) > 0) changes.push_back({robot, false, kTakenBack});
      if (++writers_of_[robot] == 1) changes.push_back({robot, true, ""});
      break;
    }
    case BusEvent::Kind::kEndpointGone: {
      std::string robot;
      if (drop(event.endpoint.key, robot)) leaving_[robot] = {event.participant, now};
      break;
    }
    case BusEvent::Kind::kParticipant:
      break;
    case BusEvent::Kind::kParticipantLeft:
    case BusEvent::Kind::kParticipantLost: {
      const bool lost = event.kind == BusEvent::Kind::kParticipantLost;
      const std::string reason = lost ? lease_text(event.lease_s) : "it left the bus in order";
      for (auto it = writers_.begin(); it != writers_.end();) {
        const auto writer = it++;
        std::string robot;
        if (writer->second.participant == event.participant && drop(writer->first, robot)) {
          leaving_[robot] = {event.participant, now};
        }
      }
      for (auto it = leaving_.begin(); it != leaving_.end();) {
        const auto robot = it++;
        if (robot->second.participant != event.participant) continue;
        changes.push_back({robot->first, false, reason});
        leaving_.erase(robot);
      }
      break;
    }
  }
  return changes;
}

}  // namespace pocd::dds
