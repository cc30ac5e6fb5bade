// Frames from files, in order: what all sources have in common.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pocd/input/frame.hpp"

namespace pocd {

/// One camera mounted on a robot, as published in tf_static.
struct CameraExtrinsics {
  std::string base_frame = "base_link";
  std::string camera_frame = "camera_color_optical_frame";
  Pose T_B_C = Pose::Identity();
};

/// What readers have in common. next() skips bad frames: each adds one line to `problems()` that
/// names file (and line) and is counted; a source that cannot be read at all throws InputError from
/// open.
class DatasetReader {
 public:
  virtual ~DatasetReader() = default;

  /// The next good frame, or nothing at the end. Frame::sequence is the frame's number in the
  /// listing, bad ones counted, so that a message can be traced to its file.
  virtual std::optional<Frame> next() = 0;
  /// Number of frames the source lists (good or bad), 0 if not known.
  virtual std::size_t size() const = 0;
  virtual CameraExtrinsics extrinsics() const { return {}; }

  const std::vector<std::string>& problems() const { return problems_; }
  std::size_t skipped() const { return skipped_; }

 protected:
  void skip(const std::string& problem) {
    problems_.push_back(problem);
    ++skipped_;
  }

  std::vector<std::string> problems_;
  std::size_t skipped_ = 0;
};

}  // namespace pocd
