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

/// From messages, wherever they come from, to poses of cameras. Poses and intrinsics only, no
/// images. Not thread-safe.
class RobotPoses {
 public:
  static constexpr std::size_t kMostRobots = 200;

  RobotPoses();

  /// False: there are more robots than are followed.
  bool know(const std::string& name);
  void forget(const std::string& name) { robots_.erase(name); }
  void transforms(const tf2_msgs::msg::TFMessage& message, bool is_static,
                  const std::string& topic);
  /// Of robots that are known.
  void odometry(const std::string& name, const nav_msgs::msg::Odometry& message,
                const std::string& topic);
  void camera_info(const std::string& name, const sensor_msgs::msg::CameraInfo& message,
                   const std::string& topic);
  /// Of each robot whose camera has moved since the last call. `frame` is the map's.
  std::vector<RobotPose> take(const std::string& frame);
  dds::ProblemCounter& problems() { return problems_; }

 private:
  struct Robot {
    explicit Robot(const TransformTree& shared);
    TransformTree tree;
    std::string camera_frame;
    CameraModel camera;
    StampNs image_ns = 0, shown_ns = 0;
  };
  TransformTree shared_;
  std::map<std::string, std::unique_ptr<Robot>> robots_;
  dds::ProblemCounter problems_;
};

/// Reads the bus. Not thread-safe.
class Robots {
 public:
  /// `wakeup` must outlive it.
  Robots(std::shared_ptr<dds::Participant> participant, RobotTopics topics, dds::Wakeup& wakeup);

  /// Listens to these and no others.
  void follow(const std::set<std::string>& names);
  /// See RobotPoses::take().
  std::vector<RobotPose> take(const std::string& frame);
  std::uint64_t problems() { return poses_.problems().total(); }

 private:
  struct Readers {
    Readers(const std::shared_ptr<dds::Participant>& participant, const RobotTopics& topics,
            const std::string& name, dds::Wakeup& wakeup);
    dds::Reader<nav_msgs::msg::OdometryPubSubType> odometry;
    dds::Reader<sensor_msgs::msg::CameraInfoPubSubType> camera_info;
  };

  std::shared_ptr<dds::Participant> participant_;
  RobotTopics topics_;
  dds::Wakeup& wakeup_;
  RobotPoses poses_;
  dds::Reader<tf2_msgs::msg::TFMessagePubSubType> tf_, tf_static_;
  std::map<std::string, std::unique_ptr<Readers>> robots_;
};

}  // namespace pocd::view
