#include "pocd/input/input_topics.hpp"

#include <algorithm>

#include "pocd/input/robot_topic.hpp"

namespace pocd {
namespace {

bool ends_with(const std::string& text, const std::string& tail) {
  return text.size() >= tail.size() &&
         text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

const std::string& pattern_of(const TopicPatterns& topics, InputStream stream) {
  switch (stream) {
    case InputStream::kDepth:
      return topics.depth;
    case InputStream::kSegmentation:
      return topics.segmentation;
    case InputStream::kColor:
      return topics.color;
    case InputStream::kCameraInfo:
      return topics.camera_info;
    case InputStream::kOdometry:
      return topics.odometry;
    case InputStream::kTf:
      return topics.tf;
    case InputStream::kTfStatic:
      break;
  }
  return topics.tf_static;
}

const std::string& own_topic(const RobotConfig& robot, InputStream stream) {
  switch (stream) {
    case InputStream::kDepth:
      return robot.depth_topic;
    case InputStream::kSegmentation:
      return robot.segmentation_topic;
    case InputStream::kColor:
      return robot.color_topic;
    case InputStream::kCameraInfo:
      return robot.camera_info_topic;
    case InputStream::kOdometry:
      return robot.odometry_topic;
    case InputStream::kTf:
      return robot.tf_topic;
    case InputStream::kTfStatic:
      break;
  }
  return robot.tf_static_topic;
}

}  // namespace

const char* ros_type(InputStream stream, bool compressed) {
  switch (stream) {
    case InputStream::kDepth:
    case InputStream::kSegmentation:
    case InputStream::kColor:
      return compressed ? "sensor_msgs/msg/CompressedImage" : "sensor_msgs/msg/Image";
    case InputStream::kCameraInfo:
      return "sensor_msgs/msg/CameraInfo";
    case InputStream::kOdometry:
      return "nav_msgs/msg/Odometry";
    case InputStream::kTf:
    case InputStream::kTfStatic:
      break;
  }
  return "tf2_msgs/msg/TFMessage";
}

std::string bus_name(const std::string& topic) {
  return !topic.empty() && topic[0] == '/' ? "rt" + topic : topic;
}

bool is_compressed_name(const std::string& topic) {
  return ends_with(topic, "/compressed") || ends_with(topic, "/compressedDepth");
}

std::string topic_of(const InputConfig& input, const RobotConfig& robot, InputStream stream) {
  const std::string& own = own_topic(robot, stream);
  return bus_name(own.empty() ? robot_topic(pattern_of(input.topics, stream), robot.name) : own);
}

bool has_own_tf(const InputConfig& input, const RobotConfig& robot) {
  return !robot.tf_topic.empty() || input.topics.own_tf();
}

InputTopics::InputTopics(const InputConfig& input) {
  std::vector<InputStream> streams{InputStream::kDepth, InputStream::kCameraInfo,
                                   InputStream::kOdometry};
  if (input.segmentation != StreamUse::kAbsent) streams.push_back(InputStream::kSegmentation);
  if (input.color != StreamUse::kAbsent) streams.push_back(InputStream::kColor);
  const std::vector<InputStream> transforms{InputStream::kTf, InputStream::kTfStatic};
  for (const RobotConfig& robot : input.robots) {
    const auto add = [&](InputStream stream) {
      named_.emplace(topic_of(input, robot, stream), InputTopic{robot.name, stream});
    };
    names_.push_back(robot.name);
    for (const InputStream stream : streams) add(stream);
    if (has_own_tf(input, robot)) std::for_each(transforms.begin(), transforms.end(), add);
  }
  for (const InputStream stream : transforms) {
    if (input.topics.own_tf()) continue;
    named_.emplace(bus_name(pattern_of(input.topics, stream)), InputTopic{"", stream});
  }
  if (!input.discovers()) return;
  if (input.topics.own_tf()) streams.insert(streams.end(), transforms.begin(), transforms.end());
  for (const InputStream stream : streams) {
    patterns_.emplace_back(bus_name(pattern_of(input.topics, stream)), stream);
  }
}

std::vector<InputTopic> InputTopics::find(const std::string& topic) const {
  std::vector<InputTopic> found;
  const auto [begin, end] = named_.equal_range(topic);
  for (auto entry = begin; entry != end; ++entry) found.push_back(entry->second);
  for (const auto& [pattern, stream] : patterns_) {
    const auto robot = robot_in(pattern, topic);
    if (!robot || std::find(names_.begin(), names_.end(), *robot) != names_.end()) continue;
    found.push_back({*robot, stream});
  }
  return found;
}

}  // namespace pocd
