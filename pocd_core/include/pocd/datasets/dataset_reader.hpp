// Frames from files, in order. Implementations: torwic, rgbd, pcd; and the simulator.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
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

/// What readers have in common. next() skips bad frames: each adds one line to `problems()` that names
/// file (and line) and is counted; a source that cannot be read at all throws InputError from open.
class DatasetReader {
 public:
  virtual ~DatasetReader() = default;

  /// The next good frame, or nothing at the end.
  virtual std::optional<Frame> next() = 0;
  /// Number of frames the source lists (good or bad), 0 if not known.
  virtual std::size_t size() const = 0;
  virtual CameraExtrinsics extrinsics() const { return {}; }

  const std::vector<std::string>& problems() const { return problems_; }
  std::size_t skipped() const { return skipped_; }

 protected:
  std::vector<std::string> problems_;
  std::size_t skipped_ = 0;
};

struct DatasetOptions {
  std::string format;  ///< "torwic", "rgbd", "pcd", "sim"
  std::vector<std::filesystem::path> inputs;  ///< visited in order as one run; stamps are shifted to go on
  int repeat = 1;        ///< frames made of each still image (pcd)
  double frame_rate_hz = 15.0;  ///< for sources without stamps
  /// Unit vector pointing down in the source's world frame; frames are rotated so that it becomes -z.
  Eigen::Vector3d gravity_W = -Eigen::Vector3d::UnitZ();
  std::uint64_t seed = 1;  ///< simulator noise
};

/// Throws InputError: unknown format (listing the known ones), missing or empty folder, unreadable
/// intrinsics; the text names the path.
std::unique_ptr<DatasetReader> open_dataset(const DatasetOptions& options);

}  // namespace pocd
