#include "pocd_dds/doctor/bus_checks.hpp"

#include <set>

namespace pocd::dds {
namespace {

/// A topic that a robot should have.
struct Expected {
  std::string topic;
  const TopicSpec& spec;
  Severity if_missing;
  std::string lacking;  ///< what it means that nobody announces it
};

Severity severity_of(const std::string& use) {
  return use == "required" ? Severity::kError : Severity::kNote;
}

std::string or_else(const std::string& own, const std::string& pattern, const std::string& robot) {
  return own.empty() ? robot_topic(pattern, robot) : own;
}

std::vector<Expected> expected_of(const RobotConfig& robot, const NodeConfig& node) {
  const TopicPatterns& patterns = node.topics;
  std::vector<Expected> list{
      {or_else(robot.depth_topic, patterns.depth, robot.name), topics::kDepth, Severity::kError,
       "no depth images: the robot is not there"},
      {or_else(robot.camera_info_topic, patterns.camera_info, robot.name), topics::kCameraInfo,
       Severity::kError, "no intrinsics: none of its images can be used"}};
  if (node.segmentation != "absent") {
    list.push_back({or_else(robot.segmentation_topic, patterns.segmentation, robot.name),
                    topics::kSegmentation, severity_of(node.segmentation), "no segmentation"});
  }
  if (node.color != "absent") {
    list.push_back({or_else(robot.color_topic, patterns.color, robot.name), topics::kColor,
                    severity_of(node.color), "no colour images"});
  }
  return list;
}

void check_writers(const std::vector<BusEndpoint>& writers, const std::string& topic,
                   const TopicSpec& spec, bool reliable, Findings& findings) {
  for (const BusEndpoint& writer : writers) {
    if (writer.type != spec.type) {
      findings.push_back({Severity::kError, topic,
                          "has type " + writer.type + ", expected " + spec.type,
                          "correct the sender, or the topic in the group `node.topics`"});
    } else if (writer.keyed != spec.keyed) {
      findings.push_back({Severity::kError, topic, "is keyed: keyed and unkeyed do not match",
                          "announce it as ROS 2 does"});
    } else if (reliable && !writer.reliable) {
      findings.push_back({Severity::kError, topic, "is offered best effort, asked for reliable",
                          "make the sender reliable, or do without node.lossless"});
    } else if (spec.delivery.transient_local && !writer.transient_local) {
      findings.push_back({Severity::kError, topic, "is offered volatile, asked for transient local",
                          "latch it (transient local), as ROS 2 does with tf_static"});
    }
  }
}

void check_robot(const BusPicture& bus, const RobotConfig& robot, const NodeConfig& node,
                 Findings& findings) {
  for (const Expected& expected : expected_of(robot, node)) {
    const auto writers = bus.endpoints(expected.topic, true);
    if (writers.empty()) {
      findings.push_back({expected.if_missing, expected.topic,
                          "nobody announces it: " + expected.lacking,
                          "start the sender, or correct the name in the group `node.topics`"});
    }
    check_writers(writers, expected.topic, expected.spec, node.lossless, findings);
  }
  const std::string odometry = or_else(robot.odometry_topic, node.topics.odometry, robot.name);
  const std::string tf = robot_topic(node.topics.tf, robot.name);
  const auto poses = bus.endpoints(odometry, true);
  if (poses.empty() && bus.endpoints(tf, true).empty()) {
    findings.push_back({Severity::kError, odometry,
                        "nobody announces it, nor " + tf + ": " + robot.name + " has no pose",
                        "start odometry or localisation, or correct the names in `node.topics`"});
  }
  check_writers(poses, odometry, topics::kOdometry, node.lossless, findings);
}

}  // namespace

void BusPicture::hear(const BusEvent& event) {
  switch (event.kind) {
    case BusEvent::Kind::kEndpoint:
      endpoints_[event.endpoint.key] = event.endpoint;
      break;
    case BusEvent::Kind::kEndpointGone:
      endpoints_.erase(event.endpoint.key);
      break;
    case BusEvent::Kind::kParticipant:
      participants_[event.participant] = event.participant_name;
      break;
    case BusEvent::Kind::kParticipantLeft:
    case BusEvent::Kind::kParticipantLost:
      participants_.erase(event.participant);
      break;
  }
}

std::vector<BusEndpoint> BusPicture::endpoints(const std::string& topic, bool writers) const {
  std::vector<BusEndpoint> list;
  for (const auto& [key, endpoint] : endpoints_) {
    if (endpoint.writer == writers && endpoint.topic == topic) list.push_back(endpoint);
  }
  return list;
}

Findings check_topics(const BusPicture& bus, const NodeConfig& node) {
  Findings findings;
  std::map<std::string, RobotConfig> robots;
  for (const RobotConfig& robot : node.robots) robots[robot.name] = robot;
  if (node.discovers()) {
    for (const auto& [key, endpoint] : bus.all()) {
      const std::string name =
          endpoint.writer ? robot_in(node.topics.depth, endpoint.topic).value_or("") : "";
      if (!name.empty()) robots.emplace(name, RobotConfig{}).first->second.name = name;
    }
  }
  if (robots.empty()) {
    findings.push_back({Severity::kError, node.topics.depth, "no robot announces depth images",
                        "start one, check --domain, or correct node.topics.depth"});
  }
  for (const auto& [name, robot] : robots) check_robot(bus, robot, node, findings);
  std::set<std::string> transforms;
  for (const auto& [name, robot] : robots) {
    transforms.insert(robot_topic(node.topics.tf_static, name));
  }
  for (const std::string& topic : transforms) {
    check_writers(bus.endpoints(topic, true), topic, topics::kTfStatic, true, findings);
  }
  const std::size_t nodes = bus.endpoints(topics::kObjects.name, true).size();
  if (nodes > 1) {
    findings.push_back({Severity::kNote, topics::kObjects.name,
                        std::to_string(nodes) + " nodes publish objects",
                        "each needs a node.map_id of its own; those that have not say so in "
                        "pocd/health (second_publisher)"});
  }
  return findings;
}

Findings check_intake(const IntakeStatus& intake) {
  Findings findings;
  for (const ProblemCounter::Entry& problem : intake.problems) {
    findings.push_back(
        {Severity::kError, problem.topic,
         problem.reason + " (" + std::to_string(problem.count) + " times): " + problem.detail,
         "correct the sender"});
  }
  for (const RobotStatus& robot : intake.robots) {
    if (!robot.live) continue;
    if (robot.images == 0) {
      findings.push_back({Severity::kError, robot.name,
                          "its depth images are announced, but none came",
                          "check that the camera runs, and net.core.rmem_max"});
    } else if (robot.frames == 0) {
      findings.push_back({Severity::kError, robot.name,
                          "images came, but no whole frame" +
                              (robot.waiting_for.empty() ? "" : ": " + robot.waiting_for),
                          "start what is missing"});
    }
  }
  return findings;
}

}  // namespace pocd::dds
