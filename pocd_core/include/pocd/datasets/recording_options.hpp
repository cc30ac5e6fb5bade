// Which topics of a recording frames are made of.
#pragma once

#include <string>

#include "pocd/common/types.hpp"

namespace pocd {

/// Topics as recordings name them: "/" and no "rt/". {robot} stands for any name without "/"; every
/// robot that has a depth topic is read.
struct RecordingOptions {
  std::string depth = "/{robot}/depth/image_raw";
  std::string camera_info = "/{robot}/depth/camera_info";
  std::string segmentation = "/{robot}/segmentation";
  std::string color = "/{robot}/color/image_raw";
  std::string odometry = "/{robot}/odom";
  std::string map_frame = "map";
  StampNs tolerance_ns = 1'000'000;       ///< largest difference of stamps that belong together
  StampNs max_pose_gap_ns = 500'000'000;  ///< poses further apart are not interpolated between
  /// Only the frames that the component took while it was recorded, in its order, as the topic
  /// pocd/frames says.
  bool as_live = false;
};

}  // namespace pocd
