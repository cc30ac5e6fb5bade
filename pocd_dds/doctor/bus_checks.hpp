// What is on the bus against what the configuration expects.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pocd/config/node_config.hpp"
#include "pocd/input/suggest_input.hpp"
#include "pocd_dds/doctor/finding.hpp"
#include "pocd_dds/entities/bus_watch.hpp"
#include "pocd_dds/node/intake.hpp"

namespace pocd::dds {

/// All that discovery has told so far. A writer or reader that has gone counts as long as no other
/// one has its topic: drivers that restart, and players that begin anew, are there all the same.
class BusPicture {
 public:
  void hear(const BusEvent& event);

  const std::map<ParticipantKey, std::string>& participants() const { return participants_; }
  /// Writers or readers of a topic.
  std::vector<BusEndpoint> endpoints(const std::string& topic, bool writers) const;
  std::vector<BusEndpoint> all() const;
  /// Of all writers, by name.
  std::vector<TopicInfo> topics() const;

 private:
  std::map<ParticipantKey, std::string> participants_;
  std::map<EndpointKey, BusEndpoint> endpoints_;
  std::map<std::pair<std::string, bool>, BusEndpoint> gone_;  // by topic, and whether it wrote
};

/// Topics, types and quality of service of every robot that is named or was found.
Findings check_topics(const BusPicture& bus, const NodeConfig& node);

/// What an intake made of what it heard: bad messages, missing transforms, silent streams.
Findings check_intake(const IntakeStatus& intake);

}  // namespace pocd::dds
