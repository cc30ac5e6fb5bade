// How well a node is, of what it counts. Without middleware; time is an argument.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace pocd::dds {

/// Counters since the start, and how long threads have not ended a turn.
struct HealthSigns {
  std::uint64_t write_failures = 0;   ///< of samples that somebody needs
  std::uint64_t problems = 0;         ///< with inputs, of any kind
  std::uint64_t dropped = 0;          ///< frames that there was no time for
  std::uint64_t output_failures = 0;  ///< of optional outputs
  double still_s = 0.0;               ///< the longest of the threads below
  std::string still_thread;           ///< its name
};

struct HealthVerdict {
  std::uint8_t level = 0;  ///< 0 ok, 1 warning, 2 error, as in diagnostic_msgs
  std::string why;         ///< "" when ok
};

/// The level says how the node is, not how it once was: something counts for `window_s` after it
/// was last seen to grow. Not thread-safe.
class HealthRule {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// A thread that has not ended a turn for `stall_s` hangs.
  HealthRule(double window_s, double stall_s) : window_s_(window_s), stall_s_(stall_s) {}

  HealthVerdict judge(const HealthSigns& signs, Time now) {
    // In words that say how bad it is, worst first.
    const bool hangs = signs.still_s >= stall_s_;
    const bool unwritten = grew(writes_, signs.write_failures, now);
    const bool optional = grew(outputs_, signs.output_failures, now);
    const bool dropped = grew(drops_, signs.dropped, now);
    const bool problems = grew(problems_, signs.problems, now);
    if (hangs) {
      return {2, signs.still_thread + " has not ended a turn for " +
                     std::to_string(static_cast<long>(signs.still_s)) + " s"};
    }
    if (unwritten) return {2, "samples could not be written"};
    if (optional) return {1, "an optional output fails"};
    if (dropped) return {1, "frames are dropped"};
    if (problems) return {1, "inputs have problems"};
    return {};
  }

 private:
  struct Counter {
    std::uint64_t value = 0;
    Time grown{};
    bool ever = false;
  };
  bool grew(Counter& counter, std::uint64_t value, Time now) const {
    // Counts of robots that have gone may go back: that is nothing new.
    if (value > counter.value) counter.grown = now, counter.ever = true;
    counter.value = value;
    return counter.ever && std::chrono::duration<double>(now - counter.grown).count() < window_s_;
  }

  const double window_s_, stall_s_;
  Counter writes_, problems_, drops_, outputs_;
};

}  // namespace pocd::dds
