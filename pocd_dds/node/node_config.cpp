#include "pocd_dds/node/node_config.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd::dds {

namespace {

bool has_blank(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; });
}

/// Names that no writer on the bus has: one would wait for them for ever.
void add_topic_problem(const std::string& topic, const std::string& where,
                       std::vector<std::string>& problems) {
  if (!topic.empty() && topic[0] == '/') {
    problems.push_back(where + ": \"" + topic + "\" is a name of ROS, on the bus it is \"rt" +
                       topic + "\"");
  } else if (has_blank(topic)) {
    problems.push_back(where + ": \"" + topic + "\" has a blank in it");
  }
}

}  // namespace

std::vector<std::string> MountConfig::inconsistencies() const {
  const bool plain = x_m == 0.0 && y_m == 0.0 && z_m == 0.0 && qx == 0.0 && qy == 0.0 &&
                     qz == 0.0 && std::abs(qw) == 1.0;
  if (!given && !plain) return {"given is false, so the other values would not be used"};
  const double length = std::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
  if (std::abs(length - 1.0) <= 1e-3) return {};
  return {"qx, qy, qz, qw: the quaternion has length " + std::to_string(length) + ", expected 1"};
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
  // One lost sample must not let all obstacles lapse: they are best effort.
  if (obstacles_hz > 0.0 && obstacle_lifetime_s * obstacles_hz < 2.0) {
    problems.push_back("obstacle_lifetime_s is shorter than two periods of obstacles_hz");
  }
  return problems;
}

std::vector<std::string> NodeConfig::inconsistencies() const {
  std::vector<std::string> problems;
  std::set<std::string> names;
  for (const RobotConfig& robot : robots) {
    if (robot.name.empty()) problems.push_back("robots: a robot has no name");
    if (has_blank(robot.name)) {
      problems.push_back("robots: the name \"" + robot.name + "\" has a blank in it");
    }
    for (const std::string& topic :
         {robot.depth_topic, robot.camera_info_topic, robot.segmentation_topic, robot.color_topic,
          robot.odometry_topic}) {
      add_topic_problem(topic, "robots: " + robot.name, problems);
    }
    if (!robot.name.empty() && !names.insert(robot.name).second) {
      problems.push_back("robots: the name " + robot.name + " is used twice");
    }
    if (!robot.color_topic.empty() && color == "absent") {
      problems.push_back("robots: " + robot.name + " has a color_topic, but color is absent");
    }
    if (!robot.segmentation_topic.empty() && segmentation == "absent") {
      problems.push_back("robots: " + robot.name +
                         " has a segmentation_topic, but segmentation is absent");
    }
  }
  for (const std::string& pattern : topics.of_each_robot()) {
    add_topic_problem(pattern, "topics", problems);
  }
  add_topic_problem(topics.tf, "topics", problems);
  add_topic_problem(topics.tf_static, "topics", problems);
  if (robots.size() > 1 || discover_robots) {
    for (const std::string& pattern : topics.of_each_robot()) {
      if (pattern.find("{robot}") == std::string::npos) {
        problems.push_back("topics: \"" + pattern + "\" lacks {robot}, and there are several");
      }
    }
  }
  if (topics.own_tf() != (topics.tf_static.find("{robot}") != std::string::npos)) {
    problems.push_back("topics: tf and tf_static must both have {robot}, or neither");
  }
  return problems;
}

void NodeConfig::set_robots(const std::vector<std::string>& names) {
  if (names.empty()) return;
  std::vector<RobotConfig> chosen;
  for (const std::string& name : names) {
    const auto known = std::find_if(robots.begin(), robots.end(),
                                    [&](const RobotConfig& robot) { return robot.name == name; });
    RobotConfig robot;
    if (known != robots.end()) robot = *known;
    robot.name = name;
    chosen.push_back(robot);
  }
  NodeConfig changed = *this;
  changed.robots = std::move(chosen);
  std::string text;
  for (const std::string& problem : changed.inconsistencies()) {
    text += (text.empty() ? "node: " : "\nnode: ") + problem;
  }
  if (!text.empty()) throw InputError(text);
  robots = std::move(changed.robots);
}

}  // namespace pocd::dds
