#include "view/robots.hpp"

#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::view {
namespace {

constexpr int kMost = 200;  // messages of a topic in one turn
constexpr std::size_t kMostRobots = 200;
constexpr StampNs kLargestGap_ns = 1000000000;  // a picture for eyes needs no more than that
constexpr std::size_t kPoses = 200;

}  // namespace

Robots::Robot::Robot(const std::shared_ptr<dds::Participant>& participant,
                     const RobotTopics& topics, const std::string& name,
                     const TransformTree& shared, dds::Wakeup& wakeup)
    : tree(kLargestGap_ns, kPoses, &shared),
      odometry(participant, dds::topics::kOdometry, robot_topic(topics.odometry, name),
               dds::topics::kOdometry.delivery, wakeup),
      camera_info(participant, dds::topics::kCameraInfo, robot_topic(topics.camera_info, name),
                  dds::topics::kCameraInfo.delivery, wakeup) {}

Robots::Robots(std::shared_ptr<dds::Participant> participant, RobotTopics topics,
               dds::Wakeup& wakeup)
    : participant_(std::move(participant)),
      topics_(std::move(topics)),
      wakeup_(wakeup),
      shared_(kLargestGap_ns, kPoses),
      tf_(participant_, dds::topics::kTf, wakeup),
      tf_static_(participant_, dds::topics::kTfStatic, wakeup) {}

void Robots::follow(const std::set<std::string>& names) {
  for (auto robot = robots_.begin(); robot != robots_.end();) {
    robot = names.count(robot->first) > 0 ? std::next(robot) : robots_.erase(robot);
  }
  for (const std::string& name : names) {
    if (robots_.count(name) > 0 || robots_.size() >= kMostRobots) continue;
    try {
      robots_[name] = std::make_unique<Robot>(participant_, topics_, name, shared_, wakeup_);
    } catch (const InputError& error) {
      robots_.erase(name);
      problems_.count(robot_topic(topics_.odometry, name), "no_reader", error.what(), 1);
    }
  }
}

void Robots::drain_transforms() {
  const auto add = [&](const auto& message, bool is_static, const std::string& topic) {
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
  };
  tf_.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (meta.valid) add(message, false, tf_.topic());
  });
  tf_static_.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (meta.valid) add(message, true, tf_static_.topic());
  });
  problems_.count_damaged(tf_);
  problems_.count_damaged(tf_static_);
}

void Robots::drain(Robot& robot) {
  robot.odometry.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (!meta.valid) return;
    const Checked<StampedTransform> pose = dds::transform_from(message);
    if (pose.problem) {
      problems_.count(robot.odometry.topic(), *pose.problem);
      return;
    }
    robot.tree.add(pose.value->parent, pose.value->child, pose.value->stamp_ns, pose.value->T);
  });
  robot.camera_info.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (!meta.valid) return;
    const Checked<CameraModel> camera = dds::camera_from(message);
    if (camera.problem) {
      problems_.count(robot.camera_info.topic(), *camera.problem);
      return;
    }
    robot.camera = *camera.value;
    robot.camera_frame = message.header().frame_id();
    robot.image_ns = dds::to_stamp(message.header().stamp());
  });
  problems_.count_damaged(robot.odometry);
  problems_.count_damaged(robot.camera_info);
}

std::map<std::string, Json> Robots::take(const std::string& frame) {
  drain_transforms();
  std::map<std::string, Json> moved;
  for (auto& [name, robot] : robots_) {
    drain(*robot);
    if (robot->camera_frame.empty() || robot->image_ns == robot->shown_ns) continue;
    const TransformLookup found =
        robot->tree.lookup(frame, robot->camera_frame, robot->image_ns, kLargestGap_ns);
    if (found.result != PoseLookup::kFound) continue;  // its pose may still come
    robot->shown_ns = robot->image_ns;
    const Eigen::Vector3d p = found.T_target_source.translation();
    const Eigen::Quaterniond q(found.T_target_source.linear());
    const CameraModel& camera = robot->camera;
    moved[name] = {{"type", "robot"},
                   {"name", name},
                   {"stamp", seconds(robot->image_ns)},
                   {"position", {p.x(), p.y(), p.z()}},
                   {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                   // Tangents of the view's sides: left, right, up, down.
                   {"view",
                    {camera.cx / camera.fx, (camera.width - camera.cx) / camera.fx,
                     camera.cy / camera.fy, (camera.height - camera.cy) / camera.fy}}};
  }
  return moved;
}

}  // namespace pocd::view
