// The streams of one robot of a recording, on their way to frames.
#pragma once

#include <set>

#include "pocd/datasets/recording_options.hpp"
#include "pocd/input/frame.hpp"
#include "pocd/input/time_synchronizer.hpp"

namespace pocd::recording {

/// Which of the robot's streams the recording has.
struct RecordedStreams {
  bool segmentation = false;
  bool color = false;
};

class RecordedRobot {
 public:
  RecordedRobot(const std::string& name, const RecordingOptions& options,
                const RecordedStreams& streams);
  RecordedRobot(const RecordedRobot&) = delete;
  RecordedRobot& operator=(const RecordedRobot&) = delete;

  /// What is wrong, as TimeSynchronizer and TransformTree say it: kStampBackwards and
  /// kEmptyFrameName are not taken, the rest is. Stamps are those of the run.
  std::optional<InputProblem> add_image(TimeSynchronizer::Stream stream, StampNs stamp_ns,
                                        const std::string& frame_id, cv::Mat image);
  std::optional<InputProblem> add_camera_info(StampNs stamp_ns, const CameraModel& camera);
  std::optional<InputProblem> add_odometry(const StampedTransform& transform);
  std::optional<InputProblem> add_transform(const StampedTransform& transform, bool is_static);

  /// Frames that are ready, by stamp; a frame whose images disagree adds to `problems`.
  std::vector<Frame> take(bool last_call, std::vector<std::string>& problems);
  StampNs watermark_ns() const { return synchronizer_.watermark_ns(); }
  /// Of the depth images.
  std::optional<StampNs> newest_ns() const {
    return synchronizer_.newest_ns(TimeSynchronizer::Stream::kDepth);
  }
  /// "" or what the frames that were left out lacked.
  std::string losses() const;
  std::uint64_t dropped() const;

 private:
  std::string name_;
  bool camera_frame_known_ = false;
  TransformTree transforms_;
  TimeSynchronizer synchronizer_;
  std::set<std::string> odometry_children_;
  std::uint64_t frames_ = 0;
};

}  // namespace pocd::recording
