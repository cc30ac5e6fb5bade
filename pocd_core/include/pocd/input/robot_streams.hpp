// The streams of one robot's camera on their way to frames: the one place where messages, from the
// bus or from a recording, are checked and put together.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd/input/input_topics.hpp"
#include "pocd/input/message_checks.hpp"
#include "pocd/input/problem_counter.hpp"
#include "pocd/input/time_synchronizer.hpp"

namespace pocd {

/// What the streams of all robots share; everything must outlive them.
struct StreamContext {
  const InputConfig& input;
  const LabelTable& labels;
  double max_depth_m;               ///< no pixel beyond it is used
  const TransformTree& transforms;  ///< of the topics that all robots share
  ProblemCounter& problems;         ///< everything that is refused or replaced
};

/// Puts a message's transform into `tree`; what is wrong is counted. The child frame, "" when it
/// was not taken.
std::string add_transform(const Checked<StampedTransform>& transform, bool is_static,
                          const std::string& topic, TransformTree& tree, ProblemCounter& problems);

/// Time is data time only: nothing here reads a clock. Not thread-safe.
class RobotStreams {
 public:
  using Stream = TimeSynchronizer::Stream;

  RobotStreams(const RobotConfig& robot, const StreamContext& context);
  RobotStreams(const RobotStreams&) = delete;
  RobotStreams& operator=(const RobotStreams&) = delete;

  const std::string& name() const { return robot_.name; }
  const RobotConfig& config() const { return robot_; }
  /// Its topics on the bus.
  std::string topic(InputStream stream) const { return topic_of(context_.input, robot_, stream); }
  std::string topic(Stream stream) const;

  /// Each says whether the message was taken. What is wrong with it is counted on its topic.
  bool add_image(Stream stream, StampNs stamp_ns, const std::string& frame, const ImageView& image);
  bool add_camera_info(StampNs stamp_ns, const Checked<CameraModel>& camera);
  bool add_odometry(const Checked<StampedTransform>& transform);
  /// For the topics of its own (has_own_tf); odometry goes before them.
  TransformTree& own_transforms() { return own_transforms_; }

  /// Waiting, patience, counts.
  TimeSynchronizer& synchronizer() { return synchronizer_; }
  const TimeSynchronizer& synchronizer() const { return synchronizer_; }

  /// Frames that are ready, by stamp. `last_call`: nothing more will come.
  std::vector<Frame> take(bool last_call);

  /// The source has gone, and nothing of it is pending: the next one may have other clocks, frames
  /// and intrinsics. The frames from its camera up to the map, as far as they are known.
  std::vector<std::string> restart();

  /// Frames made so far; those that were dropped for something they lacked; images left out by
  /// max_frame_rate_hz.
  std::uint64_t frames() const { return frames_; }
  std::uint64_t dropped() const;
  std::uint64_t rate_limited() const { return rate_limited_; }
  /// "" or "N without pose, M ..." about the dropped ones.
  std::string losses() const;

 private:
  bool due(StampNs stamp_ns);
  std::optional<cv::Mat> converted(Stream stream, const ImageView& image);
  bool accept_camera_frame(const std::string& frame);
  void compare_frame(Stream stream, const std::string& frame);
  std::optional<Frame> frame_of(const SyncedFrame& synced);
  bool fit(cv::Mat& image, const SyncedFrame& synced, Stream stream);
  void look_for_depth(const Frame& frame);

  RobotConfig robot_;
  StreamContext context_;
  PoseQuaternion mount_;
  TransformTree own_transforms_, transforms_;
  TimeSynchronizer synchronizer_;
  std::string camera_frame_;           ///< "" until the first depth image
  std::string depth_frame_;            ///< as the depth images name it
  std::optional<CameraModel> camera_;  ///< as its source said last
  std::optional<StampNs> due_ns_;
  int frames_without_depth_ = 0;  ///< as long as none has had a pixel in range
  bool depth_seen_ = false;
  std::uint64_t frames_ = 0, refused_ = 0, rate_limited_ = 0;
};

}  // namespace pocd
