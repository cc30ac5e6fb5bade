#include "pocd_dds/node/robot_input.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <utility>

#include "pocd/common/check.hpp"
#include "pocd_dds/node/input_topics.hpp"

namespace pocd::dds {
namespace {

// Taken in one turn, so that a topic which never stops coming does not hold up the others. More
// messages than their readers keep.
constexpr std::size_t kMostImages = 16;
constexpr int kMostMessages = 1000;
// Depth images that wait for something; the synchroniser would drop beyond twice as many.
constexpr std::size_t kHoldDepth = 32;

constexpr std::string_view kArrow = " -> ";  // between the two frames of a transform

double seconds(RobotInput::Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

std::string whole_seconds(double seconds) {
  return std::to_string(static_cast<long>(seconds)) + " s";
}

StampNs nanoseconds(double seconds) { return static_cast<StampNs>(seconds * 1e9); }

std::string text_of(const CameraModel& camera) {
  char text[120];
  std::snprintf(text, sizeof text, "%d x %d, fx %.6g, fy %.6g, cx %.6g, cy %.6g", camera.width,
                camera.height, camera.fx, camera.fy, camera.cx, camera.cy);
  return text;
}

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

std::string name_of(const std::string& own, const std::string& pattern, const RobotConfig& robot) {
  return own.empty() ? robot_topic(pattern, robot.name) : own;
}

}  // namespace

RobotInput::RobotInput(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
                       const RobotConfig& robot, const ColourTable& colours,
                       const TransformTree& shared, ProblemCounter& problems, Wakeup& wakeup,
                       LatencyLog& latency)
    : robot_(robot),
      map_frame_(node.map_frame),
      tf_topic_(robot_topic(node.topics.tf, robot.name)),
      lossless_(node.lossless),
      silent_wait_s_(node.silent_wait_s),
      camera_frame_(robot.camera_frame),
      colours_(colours),
      problems_(problems),
      wakeup_(wakeup),
      latency_(latency),
      transforms_(nanoseconds(node.max_pose_gap_s), 1000, &shared),
      synchronizer_(synchronizer_config(node, robot), transforms_),
      tf_(node.topics.own_tf()
              ? std::make_unique<TransformInput>(
                    participant, robot_topic(node.topics.tf, robot.name),
                    robot_topic(node.topics.tf_static, robot.name), node.lossless, wakeup)
              : nullptr),
      odometry_(participant, topics::kOdometry,
                name_of(robot.odometry_topic, node.topics.odometry, robot),
                input_delivery(topics::kOdometry, node.lossless), wakeup),
      camera_info_(participant, topics::kCameraInfo,
                   name_of(robot.camera_info_topic, node.topics.camera_info, robot),
                   input_delivery(topics::kCameraInfo, node.lossless), wakeup) {
  const auto image_reader = [&](const TopicSpec& spec, const std::string& topic) {
    return std::make_unique<ImageReader>(participant, spec, topic,
                                         input_delivery(spec, node.lossless), wakeup);
  };
  if (node.segmentation != "absent") {
    segmentation_ = image_reader(
        topics::kSegmentation, name_of(robot.segmentation_topic, node.topics.segmentation, robot));
    segmentation_required_ = node.segmentation == "required";
  }
  if (node.color != "absent") {
    color_ = image_reader(topics::kColor, name_of(robot.color_topic, node.topics.color, robot));
    color_required_ = node.color == "required";
  }
  depth_ = image_reader(topics::kDepth, name_of(robot.depth_topic, node.topics.depth, robot));
  if (robot.mount.given) {
    const MountConfig& mount = robot.mount;
    mount_.position = {mount.x_m, mount.y_m, mount.z_m};
    mount_.rotation = Eigen::Quaterniond(mount.qw, mount.qx, mount.qy, mount.qz).normalized();
    if (!camera_frame_.empty()) transforms_.set_static(mount.base_frame, camera_frame_, mount_);
  }
}

void RobotInput::look(Turn turn) {
  turn_ = turn;
  const bool live_before = live();
  if (live_before && !had_source_) heard(Stream::kDepth);  // silence begins now
  had_source_ = had_source_ || live_before;
  source_left_ = had_source_ && !live_before && turn != Turn::kHold;
}

void RobotInput::drain(const std::set<std::string>& shared_moved) {
  hear_transforms(shared_moved);
  drain_poses();
  drain_camera_info();
  for (ImageReader* reader : {depth_.get(), segmentation_.get(), color_.get()}) {
    if (reader != nullptr) problems_.count_incompatible(*reader);
  }
  if (turn_ == Turn::kHold) return;
  if (segmentation_) drain_images(Stream::kSegmentation, *segmentation_);
  if (color_) drain_images(Stream::kColor, *color_);
  drain_images(Stream::kDepth, *depth_);
}

void RobotInput::drain_camera_info() {
  problems_.count_incompatible(camera_info_);
  camera_info_.take_some(kMostMessages, [&](const auto& info, const SampleMeta& meta) {
    if (!meta.valid) return;
    heard(Stream::kCameraInfo);
    const Checked<CameraModel> camera = camera_from(info);
    if (camera.problem) {
      problems_.count(camera_info_.topic(), *camera.problem);
      return;
    }
    const auto problem =
        synchronizer_.add_camera_info(to_stamp(info.header().stamp()), *camera.value);
    if (problem) problems_.count(camera_info_.topic(), *problem);
    if (problem && problem->reason != InputReason::kStampsRestarted) return;
    if (camera_ && *camera_ != *camera.value) {
      problems_.count(
          camera_info_.topic(),
          {InputReason::kCameraChanged, text_of(*camera_) + " became " + text_of(*camera.value) +
                                            ", which is used from here on"});
    }
    camera_ = camera.value;
  });
  problems_.count_damaged(camera_info_);
}

void RobotInput::drain_poses() {
  problems_.count_incompatible(odometry_);
  if (tf_) hear_transforms(tf_->drain(transforms_, problems_));
  odometry_.take_some(kMostMessages, [&](const auto& message, const SampleMeta& meta) {
    if (!meta.valid) return;
    const Checked<StampedTransform> pose = transform_from(message);
    if (pose.problem) {
      problems_.count(odometry_.topic(), *pose.problem);
      return;
    }
    heard(Stream::kPose);
    const StampedTransform& T = *pose.value;
    const auto problem = transforms_.add(T.parent, T.child, T.stamp_ns, T.T);
    if (problem) problems_.count(odometry_.topic(), *problem);
    synchronizer_.pose_seen(T.stamp_ns, problem);
  });
  problems_.count_damaged(odometry_);
}

// Others send transforms, too: what counts is the one that the oldest frame waits for.
void RobotInput::hear_transforms(const std::set<std::string>& moved) {
  if (synchronizer_.blocked_by() != Stream::kPose) return;
  const std::string& edge = synchronizer_.blocking_edge();
  const std::size_t arrow = edge.find(kArrow);
  if (arrow != std::string::npos && moved.count(edge.substr(arrow + kArrow.size())) > 0) {
    heard(Stream::kPose);
  }
}

void RobotInput::drain_images(Stream stream, ImageReader& reader) {
  ConvertedImage converted;
  ImageVisit visit{
      [&](const recording::RosImage& message) { converted = convert(stream, message); }};
  SampleMeta meta;
  // At the end all that the reader holds now is wanted, but not what a writer that is still there
  // goes on to send.
  const std::size_t most = ending() ? std::max(kMostImages, reader.unread()) : kMostImages;
  for (std::size_t i = 0; i < most; ++i) {
    const bool enough = stream == Stream::kDepth && synchronizer_.pending() >= kHoldDepth;
    if (lossless_ && enough && !ending()) return;
    const double before_ms = thread_cpu_ms();
    const bool taken = reader.take(visit, meta);
    take_cpu_ms_ += thread_cpu_ms() - before_ms;
    visit.rethrow();
    problems_.count_damaged(reader);
    if (!taken) return;
    if (!meta.valid) continue;
    heard(stream);
    images_ += stream == Stream::kDepth;
    add_image(stream, std::move(converted), meta.received_ns, reader.topic());
  }
  wakeup_.wake();
}

RobotInput::ConvertedImage RobotInput::convert(Stream stream,
                                               const recording::RosImage& message) const {
  ConvertedImage converted;
  converted.header = message.header;
  const ImageView view = view_of(message);
  if (stream == Stream::kSegmentation) {
    Checked<LabelImage> labels = label_image(view, colours_);
    converted.problem = std::move(labels.problem);
    if (!labels.value) return converted;
    converted.image = std::move(labels.value->labels);
    converted.unknown_pixels = labels.value->unknown_pixels;
  } else {
    Checked<cv::Mat> image = stream == Stream::kDepth ? depth_image(view) : color_image(view);
    converted.problem = std::move(image.problem);
    if (image.value) converted.image = std::move(*image.value);
  }
  return converted;
}

void RobotInput::add_image(Stream stream, ConvertedImage&& converted, std::int64_t received_ns,
                           const std::string& topic) {
  if (converted.problem) {
    problems_.count(topic, *converted.problem);
    return;
  }
  if (converted.unknown_pixels > 0) {
    problems_.count(topic, {InputReason::kUnknownColour, "a colour of no class became class 0"},
                    converted.unknown_pixels);
  }
  const recording::RosHeader& header = converted.header;
  if (stream == Stream::kDepth && !accept_camera_frame(header.frame_id, topic)) return;
  const auto problem = synchronizer_.add_image(stream, header.stamp_ns, std::move(converted.image));
  if (problem) problems_.count(topic, *problem);
  if (stamp_refused(problem)) return;
  latency_.received(robot_.name, header.stamp_ns, received_ns);
}

bool RobotInput::accept_camera_frame(const std::string& frame, const std::string& topic) {
  if (!robot_.camera_frame.empty() || frame == camera_frame_) return true;
  if (frame.empty()) {
    problems_.count(topic, {InputReason::kEmptyFrameName, "header.frame_id is empty"});
    return false;
  }
  if (!camera_frame_.empty()) {
    problems_.count(topic,
                    {InputReason::kFrameChanged, "header.frame_id was \"" + camera_frame_ +
                                                     "\", now \"" + frame + "\": image not used"});
    return false;
  }
  camera_frame_ = frame;
  synchronizer_.set_camera_frame(frame);
  if (robot_.mount.given) transforms_.set_static(robot_.mount.base_frame, frame, mount_);
  return true;
}

void RobotInput::heard(Stream stream) {
  heard_[stream] = Clock::now();
  if (given_up_ == stream) given_up_.reset();
}

// Without loss, a frame is waited for as long as its streams have a source. One that is announced
// but says nothing, while the sender of the depth images is held back, must not hold it for ever.
void RobotInput::judge_silence() {
  const std::optional<Stream> blocker = synchronizer_.blocked_by();
  const auto now = Clock::now();
  if (!blocker || synchronizer_.pending() < kHoldDepth) {
    moved_on_ = now;
    return;
  }
  const auto since = std::max(moved_on_, heard_[*blocker]);
  if (!lossless_ || given_up_ || seconds(now - since) < silent_wait_s_) return;
  given_up_ = blocker;
  problems_.count(topic_of(*blocker),
                  {InputReason::kSilentStream,
                   "nothing came for " + whole_seconds(silent_wait_s_) + " while " +
                       std::to_string(synchronizer_.pending()) + " depth images of " + name() +
                       " were " + synchronizer_.waiting_for() + ": not waited for until it comes"});
}

std::string RobotInput::topic_of(Stream stream) const {
  switch (stream) {
    case Stream::kDepth:
      return depth_->topic();
    case Stream::kSegmentation:
      return segmentation_ ? segmentation_->topic() : "";
    case Stream::kColor:
      return color_ ? color_->topic() : "";
    case Stream::kCameraInfo:
      return camera_info_.topic();
    case Stream::kPose:  // a robot may say it on either
      return odometry_.topic() + " or " + tf_topic_;
  }
  return "";
}

double RobotInput::silent_s() const {
  const auto last = heard_.find(Stream::kDepth);
  return live() && last != heard_.end() ? seconds(Clock::now() - last->second) : 0.0;
}

std::string RobotInput::waiting_for() const {
  if (given_up_) return "going on without " + topic_of(*given_up_) + ", which is silent";
  return synchronizer_.waiting_for();
}

void RobotInput::set_patience() {
  const bool endless = lossless_ && given_up_ != Stream::kPose && given_up_ != Stream::kCameraInfo;
  synchronizer_.set_patience(endless ? Patience::kEndless : Patience::kBounded);
  if (!endless) return;
  // What nobody announces does not come.
  const auto of_images = [&](Stream stream, const ImageReader* reader, bool required) {
    if (reader == nullptr) return;
    if (given_up_ == stream) {
      synchronizer_.set_patience(stream, Patience::kNone);
    } else if (!required && reader->matched() == 0) {
      synchronizer_.set_patience(stream, Patience::kBounded);
    }
  };
  of_images(Stream::kSegmentation, segmentation_.get(), segmentation_required_);
  of_images(Stream::kColor, color_.get(), color_required_);
}

std::vector<Frame> RobotInput::take() {
  judge_silence();
  set_patience();

  std::vector<Frame> frames;
  const std::vector<SyncedFrame> ready = ending() ? synchronizer_.flush() : synchronizer_.take();
  if (!ready.empty()) {
    moved_on_ = Clock::now();
    // Every frame has a pose and intrinsics.
    if (given_up_ == Stream::kPose || given_up_ == Stream::kCameraInfo) given_up_.reset();
  }
  if (const auto problem = synchronizer_.take_pose_problem()) {
    problems_.count(depth_->topic(), *problem);
  }
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

std::optional<std::vector<std::string>> RobotInput::settle_departure() {
  if (!source_left_) return std::nullopt;
  std::vector<std::string> frames = transforms_.chain(map_frame_, camera_frame_);
  had_source_ = source_left_ = false;
  synchronizer_.restart();
  transforms_.forget_moving();
  heard_.clear();
  given_up_.reset();
  camera_.reset();
  if (robot_.camera_frame.empty()) camera_frame_.clear();
  return frames;
}

std::uint64_t RobotInput::dropped() const {
  const SynchronizerCounts& counts = synchronizer_.counts();
  return counts.dropped_no_segmentation + counts.dropped_no_color + counts.dropped_no_camera_info +
         counts.dropped_no_pose + counts.dropped_overflow + counts.dropped_restart + refused_;
}

std::uint64_t RobotInput::lost() const {
  return depth_->lost() + (segmentation_ ? segmentation_->lost() : 0);
}

}  // namespace pocd::dds
