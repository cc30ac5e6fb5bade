#include "view/robots.hpp"

#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::view {
namespace {

constexpr int kMost = 200;                      // messages of a topic in one turn
constexpr StampNs kLargestGap_ns = 1000000000;  // a picture for eyes needs no more than that
constexpr std::size_t kPoses = 200;

}  // namespace

RobotPoses::Robot::Robot(const TransformTree& shared) : tree(kLargestGap_ns, kPoses, &shared) {}

RobotPoses::RobotPoses() : shared_(kLargestGap_ns, kPoses) {}

bool RobotPoses::know(const std::string& name) {
  if (robots_.count(name) > 0) return true;
  if (robots_.size() >= kMostRobots) return false;
  robots_[name] = std::make_unique<Robot>(shared_);
  return true;
}

void RobotPoses::transforms(const tf2_msgs::msg::TFMessage& message, bool is_static,
                            const std::string& topic) {
  for (const auto& transform : message.transforms()) {
    const Checked<StampedTransform> checked = dds::transform_from(transform);
    if (checked.problem) {
      problems_.count(topic, *checked.problem);
      continue;
    }
    const StampedTransform& T = *checked.value;
    if (is_static) {
      shared_.set_static(T.parent, T.child, T.T);
    } else {
      shared_.add(T.parent, T.child, T.stamp_ns, T.T);
    }
  }
}

void RobotPoses::odometry(const std::string& name, const nav_msgs::msg::Odometry& message,
                          const std::string& topic) {
  const auto robot = robots_.find(name);
  if (robot == robots_.end()) return;
  const Checked<StampedTransform> pose = dds::transform_from(message);
  if (pose.problem) {
    problems_.count(topic, *pose.problem);
    return;
  }
  robot->second->tree.add(pose.value->parent, pose.value->child, pose.value->stamp_ns,
                          pose.value->T);
}

void RobotPoses::camera_info(const std::string& name, const sensor_msgs::msg::CameraInfo& message,
                             const std::string& topic) {
  const auto robot = robots_.find(name);
  if (robot == robots_.end()) return;
  const Checked<CameraModel> camera = dds::camera_from(message);
  if (camera.problem) {
    problems_.count(topic, *camera.problem);
    return;
  }
  robot->second->camera = *camera.value;
  robot->second->camera_frame = message.header().frame_id();
  robot->second->image_ns = dds::to_stamp(message.header().stamp());
}

std::vector<RobotPose> RobotPoses::take(const std::string& frame) {
  std::vector<RobotPose> moved;
  for (auto& [name, robot] : robots_) {
    if (robot->camera_frame.empty() || robot->image_ns == robot->shown_ns) continue;
    const TransformLookup found =
        robot->tree.lookup(frame, robot->camera_frame, robot->image_ns, kLargestGap_ns);
    if (found.result != PoseLookup::kFound) continue;  // its pose may still come
    robot->shown_ns = robot->image_ns;
    const CameraModel& camera = robot->camera;
    RobotPose pose;
    pose.name = name;
    pose.stamp_ns = robot->image_ns;
    pose.position_W = found.T_target_source.translation();
    pose.rotation = Eigen::Quaterniond(found.T_target_source.linear());
    pose.view = {camera.cx / camera.fx, (camera.width - camera.cx) / camera.fx,
                 camera.cy / camera.fy, (camera.height - camera.cy) / camera.fy};
    moved.push_back(std::move(pose));
  }
  return moved;
}

Robots::Readers::Readers(const std::shared_ptr<dds::Participant>& participant,
                         const RobotTopics& topics, const std::string& name, dds::Wakeup& wakeup)
    : odometry(participant, dds::topics::kOdometry, robot_topic(topics.odometry, name),
               dds::topics::kOdometry.delivery, wakeup),
      camera_info(participant, dds::topics::kCameraInfo, robot_topic(topics.camera_info, name),
                  dds::topics::kCameraInfo.delivery, wakeup) {}

Robots::Robots(std::shared_ptr<dds::Participant> participant, RobotTopics topics,
               dds::Wakeup& wakeup)
    : participant_(std::move(participant)),
      topics_(std::move(topics)),
      wakeup_(wakeup),
      tf_(participant_, dds::topics::kTf, wakeup),
      tf_static_(participant_, dds::topics::kTfStatic, wakeup) {}

void Robots::follow(const std::set<std::string>& names) {
  for (auto robot = robots_.begin(); robot != robots_.end();) {
    if (names.count(robot->first) == 0) {
      poses_.forget(robot->first);
      robot = robots_.erase(robot);
    } else {
      ++robot;
    }
  }
  for (const std::string& name : names) {
    if (robots_.count(name) > 0 || !poses_.know(name)) continue;
    try {
      robots_[name] = std::make_unique<Readers>(participant_, topics_, name, wakeup_);
    } catch (const InputError& error) {
      robots_.erase(name);
      poses_.forget(name);
      poses_.problems().count(robot_topic(topics_.odometry, name), "no_reader", error.what(), 1);
    }
  }
}

std::vector<RobotPose> Robots::take(const std::string& frame) {
  tf_.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (meta.valid) poses_.transforms(message, false, tf_.topic());
  });
  tf_static_.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (meta.valid) poses_.transforms(message, true, tf_static_.topic());
  });
  poses_.problems().count_damaged(tf_);
  poses_.problems().count_damaged(tf_static_);
  for (auto& entry : robots_) {
    const std::string& name = entry.first;
    Readers& robot = *entry.second;
    robot.odometry.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
      if (meta.valid) poses_.odometry(name, message, robot.odometry.topic());
    });
    robot.camera_info.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
      if (meta.valid) poses_.camera_info(name, message, robot.camera_info.topic());
    });
    poses_.problems().count_damaged(robot.odometry);
    poses_.problems().count_damaged(robot.camera_info);
  }
  return poses_.take(frame);
}

}  // namespace pocd::view
