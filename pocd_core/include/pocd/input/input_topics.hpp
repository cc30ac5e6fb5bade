// Which topics frames are made of, and whose they are.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pocd/input/input_config.hpp"

namespace pocd {

enum class InputStream { kDepth, kSegmentation, kColor, kCameraInfo, kOdometry, kTf, kTfStatic };

inline bool is_image(InputStream stream) {
  return stream == InputStream::kDepth || stream == InputStream::kSegmentation ||
         stream == InputStream::kColor;
}
/// As ROS names the type of a topic: "sensor_msgs/msg/Image".
const char* ros_type(InputStream stream, bool compressed = false);

/// Names of topics as they are on the bus: "/a" is "rt/a", others stay.
std::string bus_name(const std::string& topic);
/// Whether a topic is one of image_transport's compressed ones: /compressed, /compressedDepth.
bool is_compressed_name(const std::string& topic);

/// The bus name of a robot's topic; of kTf and kTfStatic its own one, or the one all share.
std::string topic_of(const InputConfig& input, const RobotConfig& robot, InputStream stream);
/// Whether the robot has topics of its own for its transforms.
bool has_own_tf(const InputConfig& input, const RobotConfig& robot);

/// What a topic feeds; `robot` is "" for the transforms that all share.
struct InputTopic {
  std::string robot;
  InputStream stream;
};

/// The input topics of named robots and, where robots are discovered, of all whose names fit.
class InputTopics {
 public:
  explicit InputTopics(const InputConfig& input);

  /// All that the topic (its bus name) feeds: cameras of one robot share odometry and transforms.
  std::vector<InputTopic> find(const std::string& topic) const;

 private:
  std::multimap<std::string, InputTopic> named_;
  std::vector<std::string> names_;                             // of the named robots
  std::vector<std::pair<std::string, InputStream>> patterns_;  // of discovered ones
};

}  // namespace pocd
