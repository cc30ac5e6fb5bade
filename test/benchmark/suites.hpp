// The frame-level part of the benchmark. Each suite writes tables; ways of doing one thing take
// turns frame by frame, so that the drift of the machine hits all of them.
#pragma once

#include <ostream>

#include "frame_set.hpp"

namespace pocd::bench {

struct SuiteOptions {
  int passes = 2;  ///< from the beginning, with new maps; the faster time of each frame counts
};

/// TSDF integration with owners beside OpenCV's hash TSDF, at 5 and 2 cm, and the two surfaces.
void run_integration(const FrameSet& set, const SuiteOptions& options, std::ostream& out);
/// process_frame by stages, beside the counterparts of PCL and OpenCV.
void run_pipeline(const FrameSet& set, const SuiteOptions& options, std::ostream& out);
/// Object ICP beside PCL's.
void run_icp(const SuiteOptions& options, std::ostream& out);

}  // namespace pocd::bench
