// A configuration for the topics that there are.
#pragma once

#include <string>
#include <vector>

#include "pocd/input/input_config.hpp"
#include "pocd/input/input_topics.hpp"

namespace pocd {

/// A topic by its bus name ("rt/a") and its type as ROS names it ("sensor_msgs/msg/Image").
struct TopicInfo {
  std::string topic, type;
};

/// "nav_msgs::msg::dds_::Odometry_", "nav_msgs/Odometry" -> "nav_msgs/msg/Odometry"; other names
/// stay.
std::string ros_type_name(const std::string& type);

/// Cameras whose depth images are among the topics, each with the topics that go with it: those of
/// the same camera, robot, or that are the only ones. Cameras are told by the names that drivers
/// use: a part with "depth", or stereo/image_raw (OAK-D). Of the depth images of one camera, raw
/// ones go before compressed ones, and those registered to colour before others.
std::vector<RobotConfig> suggest_robots(const std::vector<TopicInfo>& topics);

/// The group `node` with these robots, as YAML; "" without robots.
std::string suggestion_yaml(const std::vector<RobotConfig>& robots);

/// For a message that no depth image was found: which image topics there are (else which topics),
/// and what to write into the command line.
std::string suggestion_text(const std::vector<TopicInfo>& topics);

/// For a message that a robot's stream (camera info, masks, or poses) is on no topic: which topics
/// of its kind there are under other names, and what to write into the command line; "" when there
/// is none.
std::string instead_of(InputStream stream, const RobotConfig& robot, const InputConfig& input,
                       const std::vector<TopicInfo>& topics);

}  // namespace pocd
