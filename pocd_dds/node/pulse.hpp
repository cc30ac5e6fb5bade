// Whether a thread still takes its turns.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace pocd::dds {

/// Thread-safe. One thread beats, whenever it has ended a turn; others ask.
class Pulse {
 public:
  void beat() { last_ns_ = now_ns(); }
  /// How long it has not beaten, at first since it was made [s].
  double still_s() const { return 1e-9 * static_cast<double>(now_ns() - last_ns_); }

 private:
  static std::int64_t now_ns() {
    return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  std::atomic<std::int64_t> last_ns_{now_ns()};
};

}  // namespace pocd::dds
