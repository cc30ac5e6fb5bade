#include "pocd/config/node_config.hpp"

#include <algorithm>
#include <cctype>

namespace pocd {

std::vector<std::string> RosOutputConfig::inconsistencies() const {
  std::vector<std::string> problems;
  if (!(occupancy_low_m < occupancy_high_m)) {
    problems.push_back("occupancy_low_m must be below occupancy_high_m");
  }
  const auto bad = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_';
  };
  if (topic_namespace.empty() || std::any_of(topic_namespace.begin(), topic_namespace.end(), bad) ||
      std::isdigit(static_cast<unsigned char>(topic_namespace[0])) != 0) {
    problems.push_back("namespace: \"" + topic_namespace +
                       "\", expected letters, digits and _, no digit first");
  }
  // One lost sample must not let all obstacles lapse: they are best effort.
  if (obstacles_hz > 0.0 && obstacle_lifetime_s * obstacles_hz < 2.0) {
    problems.push_back("obstacle_lifetime_s is shorter than two periods of obstacles_hz");
  }
  return problems;
}

}  // namespace pocd
