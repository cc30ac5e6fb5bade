// Where the robots' cameras are, from the topics that the node listens to, too.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include "nav_msgsPubSubTypes.h"
#include "pocd/input/camera_model.hpp"
#include "pocd/input/robot_topic.hpp"
#include "pocd/input/transform_tree.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "sensor_msgsPubSubTypes.h"
#include "tf2_msgsPubSubTypes.h"
#include "view/json_text.hpp"

namespace pocd::view {

struct RobotTopics {
  std::string odometry = dds::topics::kOdometry.name;
  std::string camera_info = dds::topics::kCameraInfo.name;
};

/// Reads poses and intrinsics only, no images. Not thread-safe.
class Robots {
 public:
  /// `wakeup` must outlive it.
  Robots(std::shared_ptr<dds::Participant> participant, RobotTopics topics, dds::Wakeup& wakeup);

  /// Listens to these and no others.
  void follow(const std::set<std::string>& names);
  /// Of each robot whose camera has moved since the last call: pose and intrinsics, by name.
  /// `frame` is the map's.
  std::map<std::string, Json> take(const std::string& frame);
  const dds::ProblemCounter& problems() const { return problems_; }

 private:
  struct Robot {
    Robot(const std::shared_ptr<dds::Participant>& participant, const RobotTopics& topics,
          const std::string& name, const TransformTree& shared, dds::Wakeup& wakeup);
    TransformTree tree;
    dds::Reader<nav_msgs::msg::OdometryPubSubType> odometry;
    dds::Reader<sensor_msgs::msg::CameraInfoPubSubType> camera_info;
    std::string camera_frame;
    CameraModel camera;
    StampNs image_ns = 0, shown_ns = 0;
  };
  void drain_transforms();
  void drain(Robot& robot);

  std::shared_ptr<dds::Participant> participant_;
  RobotTopics topics_;
  dds::Wakeup& wakeup_;
  TransformTree shared_;
  dds::Reader<tf2_msgs::msg::TFMessagePubSubType> tf_, tf_static_;
  std::map<std::string, std::unique_ptr<Robot>> robots_;
  dds::ProblemCounter problems_;
};

}  // namespace pocd::view
