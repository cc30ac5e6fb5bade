// How long frames take through the component: from the last image of a frame received to the map
// delta that holds it written. For reports only; no decision looks at it.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "pocd/common/types.hpp"

namespace pocd::dds {

/// Thread-safe. Frames that never come through are forgotten.
class LatencyLog {
 public:
  /// `file`: CSV with a line per frame; empty: none. Throws InputError when it cannot be written.
  explicit LatencyLog(const std::string& file);

  /// An image of the frame with this stamp was with the reader at `received_ns`, wall clock; the
  /// last one counts.
  void received(const std::string& robot, StampNs stamp_ns, std::int64_t received_ns);
  /// The pipeline starts with the frame, and is done with it.
  void started(const std::string& robot, StampNs stamp_ns);
  void processed(const std::string& robot, StampNs stamp_ns);
  /// What the frames processed so far changed in the map is in a step of it.
  void in_step();
  /// The deltas of all steps have been written.
  void written();
  /// Longest way of a frame since the last call [ms].
  double take_longest_ms();

 private:
  using Key = std::pair<std::string, StampNs>;
  struct Way {
    double received_ms = 0.0, started_ms = 0.0, processed_ms = 0.0;
  };

  std::mutex mutex_;
  std::map<Key, Way> on_the_way_;
  std::vector<Key> processed_, in_step_;
  std::ofstream file_;
  double longest_ms_ = 0.0;
};

}  // namespace pocd::dds
