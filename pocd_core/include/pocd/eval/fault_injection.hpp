// Faults of the sensors, put into a stream of good frames.
#pragma once

#include <memory>

#include "pocd/input/dataset_reader.hpp"

namespace pocd {

struct FaultOptions {
  /// Every `period_s` seconds of a robot's stream, alternating over the chosen faults:
  bool pose_jumps = false;   ///< 0.3 m sideways, for one to six frames
  bool mask_gaps = false;    ///< 2 s without segmentation
  bool depth_holes = false;  ///< half of the pixels without a return, for 2 s
  double period_s = 6.0;
  double jump_m = 0.3;
  double gap_s = 2.0;
  double hole_share = 0.5;
  std::uint64_t seed = 1;

  bool any() const { return pose_jumps || mask_gaps || depth_holes; }
};

/// Changes the frame as its stamp, robot and the seed say; the same frame always the same way.
/// start_ns: stamp of the first frame of the run; its first half period is left alone.
void inject_faults(const FaultOptions& options, StampNs start_ns, Frame& frame);

}  // namespace pocd
