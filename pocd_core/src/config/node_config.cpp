#include "pocd/config/node_config.hpp"

#include <algorithm>
#include <cctype>

namespace pocd {
namespace {

/// A name, or a namespace and a name: words with / between them, and perhaps one at the beginning.
bool is_ros_name(const std::string& text) {
  bool word_begins = true;
  for (std::size_t i = text[0] == '/' ? 1 : 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == '/' ? word_begins : std::isalnum(c) == 0 && c != '_') return false;
    if (word_begins && std::isdigit(c) != 0) return false;
    word_begins = c == '/';
  }
  return !word_begins;
}

}  // namespace

std::vector<std::string> GridExtentConfig::inconsistencies() const {
  const bool none = min_x_m == 0.0 && min_y_m == 0.0 && max_x_m == 0.0 && max_y_m == 0.0;
  if (none || given()) return {};
  return {"min_x_m must be below max_x_m, and min_y_m below max_y_m; all 0: no fixed extent"};
}

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
  if (!ros_node.empty() && !is_ros_name(ros_node)) {
    problems.push_back("ros_node: \"" + ros_node +
                       "\", expected a name of ROS 2 such as pocd or /site/pocd: letters, digits "
                       "and _, no digit first");
  }
  // One lost sample must not let all obstacles lapse: they are best effort.
  if (obstacles_hz > 0.0 && obstacle_lifetime_s * obstacles_hz < 2.0) {
    problems.push_back("obstacle_lifetime_s is shorter than two periods of obstacles_hz");
  }
  return problems;
}

}  // namespace pocd
