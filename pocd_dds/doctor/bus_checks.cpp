#include "pocd_dds/doctor/bus_checks.hpp"

#include <algorithm>
#include <set>

#include "pocd/input/robot_topic.hpp"
#include "pocd_dds/node/input_delivery.hpp"

namespace pocd::dds {
namespace {

/// A topic that a robot should have.
struct Expected {
  InputStream stream;
  Severity if_missing;
  std::string lacking;  ///< what it means that nobody announces it
};

Severity severity_of(StreamUse use) {
  return use == StreamUse::kRequired ? Severity::kError : Severity::kNote;
}

std::vector<Expected> expected_of(const NodeConfig& node) {
  std::vector<Expected> list{
      {InputStream::kDepth, Severity::kError, "no depth images: the robot is not there"},
      {InputStream::kCameraInfo, Severity::kError,
       "no intrinsics: none of its images can be used"}};
  if (node.segmentation != StreamUse::kAbsent) {
    list.push_back({InputStream::kSegmentation, severity_of(node.segmentation), "no segmentation"});
  }
  if (node.color != StreamUse::kAbsent) {
    list.push_back({InputStream::kColor, severity_of(node.color), "no colour images"});
  }
  return list;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

std::string with(const std::string& advice, const std::string& more) {
  return more.empty() ? advice : advice + "; " + more;
}

/// What to do about a topic that nobody announces.
std::string advice_for(const BusPicture& bus, const RobotConfig& robot, const NodeConfig& node,
                       InputStream stream) {
  const std::string topic = topic_of(node, robot, stream);
  if (topic.compare(0, 3, "rt/") == 0) {
    for (const std::string& bare : {topic.substr(3), topic.substr(2)}) {
      if (bus.endpoints(bare, true).empty()) continue;
      return "there is " + bare +
             ", without rt/, which ROS 2 puts before its names: give that name "
             "to the topic in the group `node`, or announce it as ROS 2 does";
    }
  }
  return with("start the sender, or correct the name in the group `node.topics`",
              stream == InputStream::kDepth ? suggestion_text(bus.topics())
                                            : instead_of(stream, robot, node, bus.topics()));
}

void check_writers(const std::vector<BusEndpoint>& writers, const std::string& topic,
                   const TopicSpec& spec, bool reliable, Findings& findings) {
  for (const BusEndpoint& writer : writers) {
    if (writer.type != spec.type) {
      findings.push_back({Severity::kError, topic,
                          "has type " + writer.type + ", expected " + spec.type,
                          "correct the sender, or the topic in the group `node.topics`"});
    } else if (!writer.partitions.empty()) {
      findings.push_back(
          {Severity::kError, topic,
           "is in the partition " + joined(writer.partitions) +
               ": not heard, the component is in none",
           "take the sender out of its partition, or put both into one by a profile"});
    } else if (writer.keyed != spec.keyed) {
      findings.push_back({Severity::kError, topic, "is keyed: keyed and unkeyed do not match",
                          "announce it as ROS 2 does"});
    } else if (reliable && !writer.reliable) {
      findings.push_back({Severity::kError, topic, "is offered best effort, asked for reliable",
                          "make the sender reliable, or do without node.lossless and "
                          "node.reliable_tf_and_info"});
    } else if (spec.delivery.transient_local && !writer.transient_local) {
      findings.push_back({Severity::kError, topic, "is offered volatile, asked for transient local",
                          "latch it (transient local), as ROS 2 does with tf_static"});
    }
  }
}

void check_robot(const BusPicture& bus, const RobotConfig& robot, const NodeConfig& node,
                 Findings& findings) {
  for (const Expected& expected : expected_of(node)) {
    const std::string topic = topic_of(node, robot, expected.stream);
    const auto writers = bus.endpoints(topic, true);
    if (writers.empty()) {
      findings.push_back({expected.if_missing, topic, "nobody announces it: " + expected.lacking,
                          advice_for(bus, robot, node, expected.stream)});
    }
    const TopicSpec spec = spec_of(expected.stream, topic);
    check_writers(writers, topic, spec, input_delivery(spec, node).reliable, findings);
  }
  const std::string odometry = topic_of(node, robot, InputStream::kOdometry);
  const std::string tf = topic_of(node, robot, InputStream::kTf);
  const auto poses = bus.endpoints(odometry, true), transforms = bus.endpoints(tf, true);
  if (poses.empty() && transforms.empty()) {
    findings.push_back(
        {Severity::kError, odometry,
         "nobody announces it, nor " + tf + ": " + robot.name + " has no pose",
         with("start odometry or localisation, or correct the names in `node.topics`",
              instead_of(InputStream::kOdometry, robot, node, bus.topics()))});
  }
  check_writers(poses, odometry, topics::kOdometry,
                input_delivery(topics::kOdometry, node).reliable, findings);
  check_writers(transforms, tf, topics::kTf, input_delivery(topics::kTf, node).reliable, findings);
}

/// Robots whose topics lack the prefix of ROS 2.
void find_bare_robots(const BusPicture& bus, const std::string& pattern, Findings& findings) {
  if (pattern.compare(0, 3, "rt/") != 0) return;
  for (const BusEndpoint& endpoint : bus.all()) {
    const bool bare = endpoint.writer && (robot_in(pattern.substr(3), endpoint.topic) ||
                                          robot_in(pattern.substr(2), endpoint.topic));
    if (!bare) continue;
    findings.push_back({Severity::kError, endpoint.topic,
                        "looks like depth images, but lacks rt/, which ROS 2 puts before its names",
                        "name it in node.topics.depth, or announce it as ROS 2 does"});
  }
}

/// What to do about a problem with messages.
std::string advice_for(const std::string& reason) {
  const auto is = [&](InputReason known) { return reason == to_string(known); };
  if (is(InputReason::kNoMask)) {
    return "send masks with the stamps of their depth images, raise node.stamp_tolerance_s, or "
           "leave "
           "such frames out (node.segmentation: required)";
  }
  if (is(InputReason::kUnlistedClass)) return "complete classes.list, or correct the network's ids";
  if (is(InputReason::kNoUsableDepth)) return "see node.depth_scale and map.max_depth_m";
  if (is(InputReason::kOtherFrame)) {
    return "register it to depth, or send it with the frame of the depth images";
  }
  if (is(InputReason::kNoPose)) return "one clock for camera and poses; poses as often as images";
  if (is(InputReason::kNoTransform)) {
    return "send the transform, on tf or latched on tf_static, or give the robot a mount";
  }
  if (reason == "images_lost") return "see docs/operating.md: socket buffers";
  return "correct the sender";
}

}  // namespace

void BusPicture::hear(const BusEvent& event) {
  switch (event.kind) {
    case BusEvent::Kind::kEndpoint:
      endpoints_[event.endpoint.key] = event.endpoint;
      gone_.erase({event.endpoint.topic, event.endpoint.writer});
      break;
    case BusEvent::Kind::kEndpointGone:
      if (const auto known = endpoints_.find(event.endpoint.key); known != endpoints_.end()) {
        const BusEndpoint last = known->second;
        endpoints_.erase(known);
        if (endpoints(last.topic, last.writer).empty()) gone_[{last.topic, last.writer}] = last;
      }
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

std::vector<BusEndpoint> BusPicture::all() const {
  std::vector<BusEndpoint> list;
  for (const auto& [key, endpoint] : endpoints_) list.push_back(endpoint);
  for (const auto& [topic, endpoint] : gone_) list.push_back(endpoint);
  return list;
}

std::vector<BusEndpoint> BusPicture::endpoints(const std::string& topic, bool writers) const {
  std::vector<BusEndpoint> list;
  for (const BusEndpoint& endpoint : all()) {
    if (endpoint.writer == writers && endpoint.topic == topic) list.push_back(endpoint);
  }
  return list;
}

std::vector<TopicInfo> BusPicture::topics() const {
  std::vector<TopicInfo> list;
  for (const BusEndpoint& endpoint : all()) {
    if (endpoint.writer) list.push_back({endpoint.topic, ros_type_name(endpoint.type)});
  }
  std::sort(list.begin(), list.end(),
            [](const TopicInfo& a, const TopicInfo& b) { return a.topic < b.topic; });
  return list;
}

Findings check_topics(const BusPicture& bus, const NodeConfig& node) {
  Findings findings;
  std::map<std::string, RobotConfig> robots;
  for (const RobotConfig& robot : node.robots) robots[robot.name] = robot;
  const std::string pattern = bus_name(node.topics.depth);
  if (node.discovers()) {
    for (const BusEndpoint& endpoint : bus.all()) {
      const std::string name =
          endpoint.writer ? robot_in(pattern, endpoint.topic).value_or("") : "";
      if (!name.empty()) robots.emplace(name, RobotConfig{}).first->second.name = name;
    }
  }
  if (robots.empty()) {
    findings.push_back({Severity::kError, pattern, "no robot announces depth images",
                        "start one, check --domain, or correct node.topics.depth; " +
                            suggestion_text(bus.topics())});
    find_bare_robots(bus, pattern, findings);
  }
  for (const auto& [name, robot] : robots) check_robot(bus, robot, node, findings);
  std::set<std::string> transforms;
  for (const auto& [name, robot] : robots) {
    transforms.insert(topic_of(node, robot, InputStream::kTfStatic));
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
         advice_for(problem.reason)});
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
