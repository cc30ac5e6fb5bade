#include "recorded_robot.hpp"

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

SynchronizerConfig synchronizer_config(const RecordingOptions& options,
                                       const RecordedStreams& streams) {
  SynchronizerConfig config;
  config.segmentation = streams.segmentation ? StreamUse::kOptional : StreamUse::kAbsent;
  config.color = streams.color ? StreamUse::kOptional : StreamUse::kAbsent;
  config.tolerance_ns = options.tolerance_ns;
  config.map_frame = options.map_frame;
  config.camera_frame.clear();
  return config;
}

}  // namespace

RecordedRobot::RecordedRobot(const std::string& name, const RecordingOptions& options,
                             const RecordedStreams& streams)
    : name_(name),
      transforms_(options.max_pose_gap_ns),
      synchronizer_(synchronizer_config(options, streams), transforms_) {
  // Everything there is will come: how far one stream runs ahead of another says nothing.
  synchronizer_.set_patience(Patience::kEndless);
}

std::optional<InputProblem> RecordedRobot::add_image(TimeSynchronizer::Stream stream,
                                                     StampNs stamp_ns, const std::string& frame_id,
                                                     cv::Mat image) {
  if (stream == TimeSynchronizer::Stream::kDepth && !camera_frame_known_) {
    if (frame_id.empty()) {
      return InputProblem{InputReason::kEmptyFrameName, "header.frame_id is empty"};
    }
    camera_frame_known_ = true;
    synchronizer_.set_camera_frame(frame_id);
  }
  return synchronizer_.add_image(stream, stamp_ns, std::move(image));
}

std::optional<InputProblem> RecordedRobot::add_camera_info(StampNs stamp_ns,
                                                           const CameraModel& camera) {
  return synchronizer_.add_camera_info(stamp_ns, camera);
}

std::optional<InputProblem> RecordedRobot::add_odometry(const StampedTransform& transform) {
  odometry_children_.insert(transform.child);
  auto problem =
      transforms_.add(transform.parent, transform.child, transform.stamp_ns, transform.T);
  synchronizer_.pose_seen(transform.stamp_ns, problem);
  return problem;
}

std::optional<InputProblem> RecordedRobot::add_transform(const StampedTransform& transform,
                                                         bool is_static) {
  // Odometry says the same on a topic of its own; two sources of one transform would interleave.
  if (!is_static && odometry_children_.count(transform.child) > 0) return std::nullopt;
  return is_static
             ? transforms_.set_static(transform.parent, transform.child, transform.T)
             : transforms_.add(transform.parent, transform.child, transform.stamp_ns, transform.T);
}

std::vector<Frame> RecordedRobot::take(bool last_call, std::vector<std::string>& problems) {
  std::vector<Frame> frames;
  for (const SyncedFrame& synced : last_call ? synchronizer_.flush() : synchronizer_.take()) {
    const std::uint64_t sequence = frames_++;
    try {
      Frame frame =
          make_frame(synced.stamp_ns, synced.camera, synced.T_W_C, synced.depth, synced.labels,
                     synced.color, name_ + " at " + std::to_string(synced.stamp_ns) + " ns");
      frame.robot = name_;
      frame.sequence = sequence;
      frames.push_back(std::move(frame));
    } catch (const InputError& error) {
      problems.push_back(error.what());
    }
  }
  return frames;
}

std::uint64_t RecordedRobot::dropped() const {
  const SynchronizerCounts& counts = synchronizer_.counts();
  return counts.dropped_no_camera_info + counts.dropped_no_pose + counts.dropped_overflow +
         counts.dropped_restart;
}

std::string RecordedRobot::losses() const {
  const SynchronizerCounts& counts = synchronizer_.counts();
  std::string text;
  const auto add = [&](std::uint64_t count, const char* reason) {
    if (count == 0) return;
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  };
  add(counts.dropped_no_camera_info, "without camera info");
  add(counts.dropped_no_pose, "without pose");
  add(counts.dropped_overflow, "that waited too long for other streams");
  add(counts.dropped_restart, "from before the stamps started anew");
  return text.empty() ? text : name_ + ": frames left out: " + text;
}

}  // namespace pocd::recording
