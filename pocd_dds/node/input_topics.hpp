// Which topics the node listens to.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pocd_dds/node/node_config.hpp"

namespace pocd::dds {

/// The input topics of named robots and, where robots are found on the bus, of all whose names fit.
class InputTopics {
 public:
  explicit InputTopics(const NodeConfig& node);

  /// What the topic has to be; null when the node does not listen to it.
  const TopicSpec* spec_of(const std::string& topic) const;

 private:
  std::map<std::string, const TopicSpec*> named_;
  std::vector<std::pair<std::string, const TopicSpec*>> patterns_;
};

/// How the node reads a topic of its input: as the table says or, in a replay without loss, with a
/// history that holds the sender back.
Delivery input_delivery(const TopicSpec& spec, bool lossless);

}  // namespace pocd::dds
