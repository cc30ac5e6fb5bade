#include "pocd_dds/node/input_topics.hpp"

#include <string_view>

namespace pocd::dds {

InputTopics::InputTopics(const NodeConfig& node) {
  const auto add = [&](const TopicSpec& spec, const std::string& pattern,
                       std::string RobotConfig::*own) {
    for (const RobotConfig& robot : node.robots) {
      const bool has_own = own != nullptr && !(robot.*own).empty();
      named_[has_own ? robot.*own : robot_topic(pattern, robot.name)] = &spec;
    }
    if (node.discovers()) patterns_.emplace_back(pattern, &spec);
  };
  add(topics::kDepth, node.topics.depth, &RobotConfig::depth_topic);
  add(topics::kCameraInfo, node.topics.camera_info, &RobotConfig::camera_info_topic);
  add(topics::kOdometry, node.topics.odometry, &RobotConfig::odometry_topic);
  if (node.segmentation != "absent") {
    add(topics::kSegmentation, node.topics.segmentation, &RobotConfig::segmentation_topic);
  }
  if (node.color != "absent") add(topics::kColor, node.topics.color, &RobotConfig::color_topic);
  add(topics::kTf, node.topics.tf, nullptr);
  add(topics::kTfStatic, node.topics.tf_static, nullptr);
}

const TopicSpec* InputTopics::spec_of(const std::string& topic) const {
  const auto named = named_.find(topic);
  if (named != named_.end()) return named->second;
  for (const auto& [pattern, spec] : patterns_) {
    if (robot_in(pattern, topic)) return spec;
  }
  return nullptr;
}

Delivery input_delivery(const TopicSpec& spec, bool lossless) {
  if (!lossless) return spec.delivery;
  constexpr int kImages = 8, kSmallOnes = 1000;
  const bool images = std::string_view(spec.type) == topics::kDepth.type;
  return {true, false, 0, images ? kImages : kSmallOnes, 0, false, 0};
}

}  // namespace pocd::dds
