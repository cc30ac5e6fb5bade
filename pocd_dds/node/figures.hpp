// The numbers that a node gives about itself, once for diagnostics and for metrics.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pocd_dds/node/node_report.hpp"

namespace pocd::dds {

/// Frames of all robots since the start, also of those that have gone. They only grow.
struct FrameSums {
  std::uint64_t received = 0;
  std::uint64_t dropped = 0;  ///< the queue was full, or a part of the frame never came
};
FrameSums frame_sums(const NodeReport& report);

struct Figure {
  const char* key;     ///< in diagnostics, with its unit there
  std::string text;    ///< its value there
  const char* metric;  ///< its name for Prometheus, without "pocd_"; a sum ends with _total
  double value;        ///< in the unit of that name: seconds, bytes, or a count
};

/// All of them; those of a budget or a memory only where there is one.
std::vector<Figure> figures_of(const NodeReport& report);

}  // namespace pocd::dds
