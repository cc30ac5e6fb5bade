#include "pocd/input/input_config.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

bool has_blank(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; });
}

/// Names that no writer on the bus has: one would wait for them for ever.
void add_topic_problem(const std::string& topic, const std::string& where,
                       std::vector<std::string>& problems) {
  if (has_blank(topic)) problems.push_back(where + ": \"" + topic + "\" has a blank in it");
}

void check_robot(const RobotConfig& robot, const InputConfig& input,
                 std::vector<std::string>& problems) {
  if (robot.name.empty()) problems.push_back("robots: a robot has no name");
  if (has_blank(robot.name)) {
    problems.push_back("robots: the name \"" + robot.name + "\" has a blank in it");
  }
  for (const std::string& topic :
       {robot.depth_topic, robot.camera_info_topic, robot.segmentation_topic, robot.color_topic,
        robot.odometry_topic, robot.tf_topic, robot.tf_static_topic}) {
    add_topic_problem(topic, "robots: " + robot.name, problems);
  }
  if (robot.tf_topic.empty() != robot.tf_static_topic.empty()) {
    problems.push_back("robots: " + robot.name +
                       " must have both tf_topic and tf_static_topic, or neither");
  }
  if (!robot.color_topic.empty() && input.color == StreamUse::kAbsent) {
    problems.push_back("robots: " + robot.name + " has a color_topic, but color is absent");
  }
  if (!robot.segmentation_topic.empty() && input.segmentation == StreamUse::kAbsent) {
    problems.push_back("robots: " + robot.name +
                       " has a segmentation_topic, but segmentation is absent");
  }
}

/// Several robots, and one whose topic is that of a pattern without {robot}.
bool needs_a_name(const InputConfig& input, std::string RobotConfig::*own) {
  if (input.discover_robots) return true;
  const auto by_pattern = [&](const RobotConfig& robot) { return (robot.*own).empty(); };
  return input.robots.size() > 1 &&
         std::any_of(input.robots.begin(), input.robots.end(), by_pattern);
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

std::vector<std::string> InputConfig::inconsistencies() const {
  std::vector<std::string> problems;
  std::set<std::string> names;
  for (const RobotConfig& robot : robots) {
    check_robot(robot, *this, problems);
    if (!robot.name.empty() && !names.insert(robot.name).second) {
      problems.push_back("robots: the name " + robot.name + " is used twice");
    }
  }
  for (const std::string& pattern : topics.of_each_robot()) {
    add_topic_problem(pattern, "topics", problems);
  }
  add_topic_problem(topics.tf, "topics", problems);
  add_topic_problem(topics.tf_static, "topics", problems);
  const std::pair<const std::string&, std::string RobotConfig::*> patterns[] = {
      {topics.depth, &RobotConfig::depth_topic},
      {topics.camera_info, &RobotConfig::camera_info_topic},
      {topics.segmentation, &RobotConfig::segmentation_topic},
      {topics.color, &RobotConfig::color_topic}};
  for (const auto& [pattern, own] : patterns) {
    if (!needs_a_name(*this, own) || pattern.find("{robot}") != std::string::npos) continue;
    problems.push_back("topics: \"" + pattern + "\" lacks {robot}, and there are several");
  }
  if (discover_robots && topics.odometry.find("{robot}") == std::string::npos) {
    problems.push_back("topics: \"" + topics.odometry + "\" lacks {robot}, and there are several");
  }
  if (topics.own_tf() != (topics.tf_static.find("{robot}") != std::string::npos)) {
    problems.push_back("topics: tf and tf_static must both have {robot}, or neither");
  }
  return problems;
}

void InputConfig::set_robots(const std::vector<std::string>& names) {
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
  InputConfig changed = *this;
  changed.robots = std::move(chosen);
  std::string text;
  for (const std::string& problem : changed.inconsistencies()) {
    text += (text.empty() ? "node: " : "\nnode: ") + problem;
  }
  if (!text.empty()) throw InputError(text);
  robots = std::move(changed.robots);
}

}  // namespace pocd
