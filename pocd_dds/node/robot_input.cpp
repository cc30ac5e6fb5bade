#include "pocd_dds/node/robot_input.hpp"

#include <utility>

#include "pocd/common/check.hpp"

namespace pocd::dds {
namespace {

using Stream = TimeSynchronizer::Stream;

// In a replay without loss the reader's history is the buffer that holds the player back.
constexpr Delivery kLosslessImages{true, false, 0, 8, 0, false, 0};
constexpr Delivery kLosslessSmall{true, false, 0, 1000, 0, false, 0};
// Depth images that wait for something; the synchroniser would drop beyond twice as many.
constexpr std::size_t kHoldDepth = 32;

StampNs nanoseconds(double seconds) { return static_cast<StampNs>(seconds * 1e9); }

StreamUse use_of(const std::string& word) {
  if (word == "absent") return StreamUse::kAbsent;
  return word == "required" ? StreamUse::kRequired : StreamUse::kOptional;
}

SynchronizerConfig synchronizer_config(const NodeConfig& node, const RobotConfig& robot) {
  SynchronizerConfig config;
  config.segmentation = use_of(node.segmentation);
  config.color = use_of(node.color);
  config.max_wait_ns = nanoseconds(node.sync_wait_s);
  config.tolerance_ns = nanoseconds(node.stamp_tolerance_s);
  config.extrapolation_ns = nanoseconds(node.extrapolation_s);
  config.map_frame = node.map_frame;
  config.camera_frame = robot.camera_frame;
  return config;
}

std::string topic_of(const std::string& own, const std::string& pattern, const RobotConfig& robot) {
  return own.empty() ? robot_topic(pattern, robot.name) : own;
}

Delivery delivery_of(const TopicSpec& spec, bool lossless, const Delivery& instead) {
  return lossless ? instead : spec.delivery;
}

}  // namespace

RobotInput::RobotInput(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
                       const RobotConfig& robot, const ColourTable& colours,
                       ProblemCounter& problems, Wakeup& wakeup)
    : robot_(robot),
      lossless_(node.lossless),
      camera_frame_known_(!robot.camera_frame.empty()),
      colours_(colours),
      problems_(problems),
      transforms_(nanoseconds(node.max_pose_gap_s)),
      synchronizer_(synchronizer_config(node, robot), transforms_),
      odometry_(participant, topics::kOdometry,
                topic_of(robot.odometry_topic, node.topics.odometry, robot),
                delivery_of(topics::kOdometry, node.lossless, kLosslessSmall), wakeup),
      camera_info_(participant, topics::kCameraInfo,
                   topic_of(robot.camera_info_topic, node.topics.camera_info, robot),
                   delivery_of(topics::kCameraInfo, node.lossless, kLosslessSmall), wakeup) {
  const auto image_reader = [&](const TopicSpec& spec, const std::string& topic) {
    return std::make_unique<ImageReader>(participant, spec, topic,
                                         delivery_of(spec, node.lossless, kLosslessImages), wakeup);
  };
  if (node.segmentation != "absent") {
    segmentation_ = image_reader(
        topics::kSegmentation, topic_of(robot.segmentation_topic, node.topics.segmentation, robot));
    segmentation_required_ = node.segmentation == "required";
  }
  if (node.color != "absent") {
    color_ = image_reader(topics::kColor, topic_of(robot.color_topic, node.topics.color, robot));
    color_required_ = node.color == "required";
  }
  depth_ = image_reader(topics::kDepth, topic_of(robot.depth_topic, node.topics.depth, robot));
  if (robot.mount.given) {
    const MountConfig& mount = robot.mount;
    mount_.position = {mount.x_m, mount.y_m, mount.z_m};
    mount_.rotation = Eigen::Quaterniond(mount.qw, mount.qx, mount.qy, mount.qz).normalized();
    if (camera_frame_known_) transforms_.set_static(mount.base_frame, robot.camera_frame, mount_);
  }
}

void RobotInput::drain(bool hold) {
  // Looked at before the taking: what a source that has gone had sent is with the readers by then.
  const bool live_before = live();
  had_source_ = had_source_ || live_before;
  source_left_ = had_source_ && !live_before && !hold;
  drain_poses();
  sensor_msgs::msg::CameraInfo info;
  SampleMeta meta;
  while (camera_info_.take(info, meta)) {
    if (!meta.valid) continue;
    const Checked<CameraModel> camera = camera_from(info);
    if (camera.problem) {
      problems_.count(camera_info_.topic(), *camera.problem);
    } else if (!synchronizer_.add_camera_info(to_stamp(info.header().stamp()), *camera.value)) {
      problems_.count(camera_info_.topic(), backwards(info.header()));
    }
  }
  if (hold) return;
  if (segmentation_) drain_images(Stream::kSegmentation, *segmentation_);
  if (color_) drain_images(Stream::kColor, *color_);
  drain_images(Stream::kDepth, *depth_);
}

void RobotInput::drain_poses() {
  nav_msgs::msg::Odometry message;
  SampleMeta meta;
  while (odometry_.take(message, meta)) {
    if (!meta.valid) continue;
    const Checked<StampedTransform> pose = transform_from(message);
    if (pose.problem) {
      problems_.count(odometry_.topic(), *pose.problem);
      continue;
    }
    const StampedTransform& T = *pose.value;
    odometry_children_.insert(T.child);
    if (!transforms_.add(T.parent, T.child, T.stamp_ns, T.T)) {
      problems_.count(odometry_.topic(), backwards(message.header()));
    } else {
      synchronizer_.pose_seen(T.stamp_ns);
    }
  }
}

bool RobotInput::add_transform(const StampedTransform& transform, bool is_static) {
  if (is_static) {
    transforms_.set_static(transform.parent, transform.child, transform.T);
    return true;
  }
  // Odometry says the same on a topic of its own; two sources of one transform would interleave.
  if (odometry_children_.count(transform.child) > 0) return true;
  return transforms_.add(transform.parent, transform.child, transform.stamp_ns, transform.T);
}

void RobotInput::drain_images(Stream stream, ImageReader& reader) {
  sensor_msgs::msg::Image message;
  SampleMeta meta;
  while (true) {
    const bool enough = stream == Stream::kDepth && synchronizer_.pending() >= kHoldDepth;
    if (lossless_ && enough && !source_left_) return;
    if (!reader.take(message, meta)) return;
    if (meta.valid) add_image(stream, message, reader.topic());
  }
}

void RobotInput::add_image(Stream stream, const sensor_msgs::msg::Image& message,
                           const std::string& topic) {
  cv::Mat image;
  std::optional<InputProblem> problem;
  if (stream == Stream::kSegmentation) {
    Checked<LabelImage> labels = labels_from(message, colours_);
    problem = labels.problem;
    if (labels.value) {
      image = labels.value->labels;
      if (labels.value->unknown_pixels > 0) {
        problems_.count(topic, {InputReason::kUnknownColour, "a colour of no class became class 0"},
                        labels.value->unknown_pixels);
      }
    }
  } else {
    Checked<cv::Mat> checked = stream == Stream::kDepth ? depth_from(message) : color_from(message);
    problem = checked.problem;
    if (checked.value) image = *checked.value;
  }
  if (problem) {
    problems_.count(topic, *problem);
    return;
  }
  segmentation_delivers_ = segmentation_delivers_ || stream == Stream::kSegmentation;
  color_delivers_ = color_delivers_ || stream == Stream::kColor;
  if (stream == Stream::kDepth && !camera_frame_known_) {
    if (message.header().frame_id().empty()) {
      problems_.count(topic, {InputReason::kEmptyFrameName, "header.frame_id is empty"});
      return;
    }
    camera_frame_known_ = true;
    synchronizer_.set_camera_frame(message.header().frame_id());
    if (robot_.mount.given) {
      transforms_.set_static(robot_.mount.base_frame, message.header().frame_id(), mount_);
    }
  }
  if (!synchronizer_.add_image(stream, to_stamp(message.header().stamp()), std::move(image))) {
    problems_.count(topic, backwards(message.header()));
  }
}

InputProblem RobotInput::backwards(const std_msgs::msg::Header& header) {
  return {InputReason::kStampBackwards,
          "stamp " + std::to_string(to_stamp(header.stamp())) + " ns is not after the one before"};
}

std::vector<Frame> RobotInput::take(bool last_call) {
  // An optional stream is worth an endless wait only once it has delivered: an announced topic may
  // stay silent.
  const bool segmentation_comes = !segmentation_ || segmentation_required_ ||
                                  (segmentation_delivers_ && segmentation_->matched() > 0);
  const bool color_comes = !color_ || color_required_ || (color_delivers_ && color_->matched() > 0);
  synchronizer_.set_patient(lossless_ && segmentation_comes && color_comes);

  std::vector<Frame> frames;
  const std::vector<SyncedFrame> ready =
      last_call || source_left_ ? synchronizer_.flush() : synchronizer_.take();
  for (const SyncedFrame& synced : ready) {
    try {
      Frame frame = make_frame(synced.stamp_ns, synced.camera, synced.T_W_C, synced.depth,
                               synced.labels, synced.color, depth_->topic());
      frame.robot = robot_.name;
      frame.sequence = frames_++;
      frames.push_back(std::move(frame));
    } catch (const InputError& error) {
      problems_.count(depth_->topic(), {InputReason::kSizesDisagree, error.what()});
      ++refused_;
    }
  }
  return frames;
}

bool RobotInput::settle_departure() {
  if (!source_left_) return false;
  had_source_ = source_left_ = false;
  segmentation_delivers_ = color_delivers_ = false;
  synchronizer_.restart();
  transforms_.forget_moving();
  return true;
}

std::uint64_t RobotInput::dropped() const {
  const SynchronizerCounts& counts = synchronizer_.counts();
  return counts.dropped_no_segmentation + counts.dropped_no_color + counts.dropped_no_camera_info +
         counts.dropped_no_pose + counts.dropped_overflow + refused_;
}

std::uint64_t RobotInput::lost() const {
  return depth_->lost() + (segmentation_ ? segmentation_->lost() : 0);
}

}  // namespace pocd::dds
