#include "pocd/input/robot_streams.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// A first view of something far away is no mistake yet.
constexpr int kFramesWithoutDepth = 5;

StampNs nanoseconds(double seconds) { return static_cast<StampNs>(seconds * 1e9); }

std::string text_of(const CameraModel& camera) {
  char text[120];
  std::snprintf(text, sizeof text, "%d x %d, fx %.6g, fy %.6g, cx %.6g, cy %.6g", camera.width,
                camera.height, camera.fx, camera.fy, camera.cx, camera.cy);
  return text;
}

std::string size_text(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows);
}

std::string percent(std::uint64_t part, std::size_t all) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g %%",
                100.0 * static_cast<double>(part) / static_cast<double>(all));
  return text;
}

SynchronizerConfig synchronizer_config(const InputConfig& input, const RobotConfig& robot) {
  SynchronizerConfig config;
  config.segmentation = input.segmentation;
  config.color = input.color;
  config.max_wait_ns = nanoseconds(input.sync_wait_s);
  config.tolerance_ns = nanoseconds(input.stamp_tolerance_s);
  config.extrapolation_ns = nanoseconds(input.extrapolation_s);
  config.map_frame = frame_name(input.map_frame);
  config.camera_frame = frame_name(robot.camera_frame);
  return config;
}

}  // namespace

std::string add_transform(const Checked<StampedTransform>& transform, bool is_static,
                          const std::string& topic, TransformTree& tree, ProblemCounter& problems) {
  if (transform.problem) {
    problems.count(topic, *transform.problem);
    return "";
  }
  const auto& [parent, child, stamp_ns, T] = *transform.value;
  const std::optional<InputProblem> problem =
      is_static ? tree.set_static(parent, child, T) : tree.add(parent, child, stamp_ns, T);
  if (problem) problems.count(topic, *problem);
  return problem && !used_anyway(*problem) ? "" : child;
}

RobotStreams::RobotStreams(const RobotConfig& robot, const StreamContext& context)
    : robot_(robot),
      context_(context),
      own_transforms_(nanoseconds(context.input.max_pose_gap_s), 1000, &context.transforms),
      transforms_(nanoseconds(context.input.max_pose_gap_s), 1000, &own_transforms_),
      synchronizer_(synchronizer_config(context.input, robot), transforms_) {
  robot_.camera_frame = frame_name(robot_.camera_frame);
  camera_frame_ = robot_.camera_frame;
  if (robot_.depth_scale == 0.0) robot_.depth_scale = context.input.depth_scale;
  const MountConfig& mount = robot.mount;
  if (!mount.given) return;
  robot_.mount.base_frame = frame_name(mount.base_frame);
  mount_.position = {mount.x_m, mount.y_m, mount.z_m};
  mount_.rotation = Eigen::Quaterniond(mount.qw, mount.qx, mount.qy, mount.qz).normalized();
  if (robot_.camera_frame.empty()) return;
  transforms_.set_static(robot_.mount.base_frame, robot_.camera_frame, mount_);
}

std::string RobotStreams::topic(Stream stream) const {
  switch (stream) {
    case Stream::kDepth:
      return topic(InputStream::kDepth);
    case Stream::kSegmentation:
      return topic(InputStream::kSegmentation);
    case Stream::kColor:
      return topic(InputStream::kColor);
    case Stream::kCameraInfo:
      return topic(InputStream::kCameraInfo);
    case Stream::kPose:  // a robot may say it on either
      break;
  }
  return topic(InputStream::kOdometry) + " or " + topic(InputStream::kTf);
}

bool RobotStreams::due(StampNs stamp_ns) {
  const double rate_hz = context_.input.max_frame_rate_hz;
  if (rate_hz <= 0.0) return true;
  const StampNs period_ns = nanoseconds(1.0 / rate_hz);
  // The next one is due a period after this one was, so that the rate is kept in the mean; a
  // source that starts anew or paused begins a new rhythm.
  const bool apart = !due_ns_ || stamp_ns >= *due_ns_ + period_ns ||
                     stamp_ns < *due_ns_ - 2 * period_ns - StampOrder::kFarBack;
  if (!apart && stamp_ns < *due_ns_) {
    ++rate_limited_;
    return false;
  }
  due_ns_ = (apart ? stamp_ns : *due_ns_) + period_ns;
  return true;
}

std::optional<cv::Mat> RobotStreams::converted(Stream stream, const ImageView& image) {
  const std::string on = topic(stream);
  if (stream != Stream::kSegmentation) {
    Checked<cv::Mat> checked = stream == Stream::kDepth ? depth_image(image) : color_image(image);
    if (checked.problem) context_.problems.count(on, *checked.problem);
    return std::move(checked.value);
  }
  Checked<LabelImage> labels = label_image(image, context_.labels);
  if (labels.problem) {
    context_.problems.count(on, *labels.problem);
    return std::nullopt;
  }
  const LabelImage& mask = *labels.value;
  const auto share = [&](std::uint64_t pixels) {
    return "; " + percent(pixels, mask.labels.total()) + " of the pixels";
  };
  if (mask.unknown_pixels > 0) {
    std::string colours;
    for (const std::string& rgb : mask.unknown) colours += (colours.empty() ? "" : "; ") + rgb;
    const char* none = context_.labels.has_colours() ? "" : " (no class has an rgb)";
    context_.problems.count(on,
                            {InputReason::kUnknownColour,
                             "colours r,g,b of no class of classes.list" + std::string(none) +
                                 " became class 0: " + colours + share(mask.unknown_pixels)},
                            mask.unknown_pixels);
  }
  if (mask.unlisted_pixels > 0) {
    std::string ids;
    bool large = false;
    for (const auto id : mask.unlisted) {
      ids += (ids.empty() ? "" : ", ") + std::to_string(id);
      large = large || id > 255;
    }
    const char* instances = large ? " (of panoptic masks, see classes.label_divisor)" : "";
    context_.problems.count(on, {InputReason::kUnlistedClass,
                                 "ids that are no class of classes.list and so background: " + ids +
                                     share(mask.unlisted_pixels) + instances});
  }
  return mask.labels;
}

bool RobotStreams::add_image(Stream stream, StampNs stamp_ns, const std::string& frame,
                             const ImageView& image) {
  if (stream == Stream::kDepth && !due(stamp_ns)) return false;
  std::optional<cv::Mat> pixels = converted(stream, image);
  if (!pixels) return false;
  if (stream == Stream::kDepth && !accept_camera_frame(frame_name(frame))) return false;
  if (stream == Stream::kDepth) {
    depth_frame_ = frame_name(frame);
  } else {
    compare_frame(stream, frame_name(frame));
  }
  const auto problem = synchronizer_.add_image(stream, stamp_ns, std::move(*pixels));
  if (problem) context_.problems.count(topic(stream), *problem);
  return !stamp_refused(problem);
}

/// Masks and colour are of the pixels of the depth image; those of another camera are not.
void RobotStreams::compare_frame(Stream stream, const std::string& frame) {
  if (frame.empty() || depth_frame_.empty() || frame == depth_frame_) return;
  context_.problems.count(topic(stream),
                          {InputReason::kOtherFrame,
                           "header.frame_id is \"" + frame + "\", that of the depth images \"" +
                               depth_frame_ + "\": used as it is, but is it registered to depth?"});
}

bool RobotStreams::accept_camera_frame(const std::string& frame) {
  if (!robot_.camera_frame.empty() || (!frame.empty() && frame == camera_frame_)) return true;
  if (frame.empty()) {
    context_.problems.count(topic(Stream::kDepth),
                            {InputReason::kEmptyFrameName, "header.frame_id is empty"});
    return false;
  }
  if (!camera_frame_.empty()) {
    context_.problems.count(topic(Stream::kDepth),
                            {InputReason::kFrameChanged,
                             "header.frame_id was \"" + camera_frame_ + "\", now \"" + frame +
                                 "\": image not used (another camera needs an entry of its own)"});
    return false;
  }
  camera_frame_ = frame;
  synchronizer_.set_camera_frame(frame);
  if (robot_.mount.given) transforms_.set_static(robot_.mount.base_frame, frame, mount_);
  return true;
}

bool RobotStreams::add_camera_info(StampNs stamp_ns, const Checked<CameraModel>& camera) {
  const std::string on = topic(Stream::kCameraInfo);
  if (camera.problem) {
    context_.problems.count(on, *camera.problem);
    return false;
  }
  const auto problem = synchronizer_.add_camera_info(stamp_ns, *camera.value);
  if (problem) context_.problems.count(on, *problem);
  if (stamp_refused(problem)) return false;
  if (camera_ && *camera_ != *camera.value) {
    context_.problems.count(
        on, {InputReason::kCameraChanged, text_of(*camera_) + " became " + text_of(*camera.value) +
                                              ", which is used from here on"});
  }
  camera_ = camera.value;
  return true;
}

bool RobotStreams::add_odometry(const Checked<StampedTransform>& transform) {
  const std::string on = topic(InputStream::kOdometry);
  if (transform.problem) {
    context_.problems.count(on, *transform.problem);
    return false;
  }
  const StampedTransform& T = *transform.value;
  const auto problem = transforms_.add(T.parent, T.child, T.stamp_ns, T.T);
  if (problem) context_.problems.count(on, *problem);
  synchronizer_.pose_seen(T.stamp_ns, problem);
  return true;
}

bool RobotStreams::fit(cv::Mat& image, const SyncedFrame& synced, Stream stream) {
  if (image.empty()) return true;
  if (auto fitted = resized_to(image, synced.depth.cols, synced.depth.rows)) {
    image = std::move(*fitted);
    return true;
  }
  context_.problems.count(
      topic(stream), {InputReason::kSizesDisagree,
                      "is " + size_text(image) + ", the depth image is " + size_text(synced.depth) +
                          ": sides of another ratio; frame not used"});
  ++refused_;
  return false;
}

std::optional<Frame> RobotStreams::frame_of(const SyncedFrame& synced) {
  const std::string on = topic(Stream::kDepth);
  cv::Mat labels = synced.labels, color = synced.color;
  if (!fit(labels, synced, Stream::kSegmentation) || !fit(color, synced, Stream::kColor)) {
    return std::nullopt;
  }
  try {
    Frame frame =
        make_frame(synced.stamp_ns, synced.camera, synced.T_W_C, synced.depth, labels, color, on);
    if (robot_.depth_scale != 1.0) {
      frame.depth_m.convertTo(frame.depth_m, CV_32F, robot_.depth_scale);
    }
    frame.robot = robot_.name;
    frame.sequence = frames_++;
    if (!depth_seen_) look_for_depth(frame);
    return frame;
  } catch (const InputError& error) {
    context_.problems.count(on, {InputReason::kSizesDisagree, error.what()});
    ++refused_;
  }
  return std::nullopt;
}

/// A unit that is not the expected one shows in depths that are all out of range.
void RobotStreams::look_for_depth(const Frame& frame) {
  std::vector<float> depths;
  for (int row = 0; row < frame.depth_m.rows; ++row) {
    const float* in = frame.depth_m.ptr<float>(row);
    for (int col = 0; col < frame.depth_m.cols; ++col) {
      if (in[col] > 0.0f) depths.push_back(in[col]);
    }
  }
  // A few specks are noise.
  const std::size_t enough = frame.depth_m.total() / 1000 + 1;
  constexpr float kNearest_m = 0.05f;
  const auto usable = std::count_if(depths.begin(), depths.end(), [&](float depth) {
    return depth >= kNearest_m && depth <= static_cast<float>(context_.max_depth_m);
  });
  depth_seen_ = static_cast<std::size_t>(usable) >= enough;
  if (depth_seen_ || ++frames_without_depth_ < kFramesWithoutDepth) return;
  std::string what = "no pixel has a depth";
  if (depths.size() >= enough) {
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    char text[260];
    std::snprintf(
        text, sizeof text,
        "the median depth is %.4g m, none is from %.2g to %.4g m (map.max_depth_m): is the unit "
        "another one (--set node.depth_scale=0.1 for tenths of a millimetre, 0.001 for float "
        "millimetres; now %g)?",
        static_cast<double>(*middle), static_cast<double>(kNearest_m), context_.max_depth_m,
        robot_.depth_scale);
    what = text;
  }
  context_.problems.count(
      topic(Stream::kDepth),
      {InputReason::kNoUsableDepth, "of the first " + std::to_string(frames_without_depth_) +
                                        " frames no pixel can be used: " + what});
}

std::vector<Frame> RobotStreams::take(bool last_call) {
  std::vector<Frame> frames;
  const std::vector<SyncedFrame> ready = last_call ? synchronizer_.flush() : synchronizer_.take();
  for (const TimeSynchronizer::Lack& lack : synchronizer_.take_lacks()) {
    const bool pose = lack.stream == Stream::kPose;
    context_.problems.count(topic(pose ? Stream::kDepth : lack.stream), lack.problem, lack.times);
  }
  for (const SyncedFrame& synced : ready) {
    if (std::optional<Frame> frame = frame_of(synced)) frames.push_back(std::move(*frame));
  }
  return frames;
}

std::vector<std::string> RobotStreams::restart() {
  std::vector<std::string> frames =
      transforms_.chain(frame_name(context_.input.map_frame), camera_frame_);
  synchronizer_.restart();
  transforms_.forget_moving();
  own_transforms_.forget_moving();
  if (robot_.camera_frame.empty()) camera_frame_.clear();
  camera_.reset();
  depth_frame_.clear();
  due_ns_.reset();
  depth_seen_ = false;
  frames_without_depth_ = 0;
  return frames;
}

std::uint64_t RobotStreams::dropped() const {
  const SynchronizerCounts& counts = synchronizer_.counts();
  return counts.dropped_no_segmentation + counts.dropped_no_color + counts.dropped_no_camera_info +
         counts.dropped_no_pose + counts.dropped_overflow + counts.dropped_restart + refused_;
}

std::string RobotStreams::losses() const {
  const SynchronizerCounts& counts = synchronizer_.counts();
  std::string text;
  const auto add = [&](std::uint64_t count, const char* reason) {
    if (count == 0) return;
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  };
  add(counts.dropped_no_camera_info, "without camera info");
  add(counts.dropped_no_pose, "without pose");
  add(counts.dropped_no_segmentation, "without segmentation");
  add(counts.dropped_no_color, "without colour");
  add(counts.dropped_overflow, "that waited too long for other streams");
  add(counts.dropped_restart, "from before the stamps started anew");
  add(refused_, "whose images do not fit together");
  add(rate_limited_, "beyond node.max_frame_rate_hz");
  return text.empty() ? text : robot_.name + ": frames left out: " + text;
}

}  // namespace pocd
