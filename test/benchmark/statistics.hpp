// Clocks and order statistics of the benchmark.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "pocd/common/cpu_time.hpp"

namespace pocd::bench {

inline double wall_ms() { return clock_ms(CLOCK_MONOTONIC); }

/// The value below which `share` of the values lie; 0 without values.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * last + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}
inline double median(const std::vector<double>& values) { return quantile(values, 0.5); }

/// What one way of doing one thing took, by frame; a repeated pass keeps the faster of the two, so
/// that what else the machine does at the time is filtered out.
class Series {
 public:
  void add(std::size_t frame, double cpu, double wall) {
    if (frame == cpu_.size()) {
      cpu_.push_back(cpu);
      wall_.push_back(wall);
      return;
    }
    cpu_.at(frame) = std::min(cpu_[frame], cpu);
    wall_.at(frame) = std::min(wall_[frame], wall);
  }
  const std::vector<double>& cpu() const { return cpu_; }
  const std::vector<double>& wall() const { return wall_; }

 private:
  std::vector<double> cpu_, wall_;
};

/// Which of three has its turn: over six frames each is first, and after each of the others, as
/// often as they.
inline std::size_t in_turn(std::size_t frame, std::size_t turn) {
  return (frame + (frame / 3 % 2 == 0 ? turn : 2 * turn)) % 3;
}

/// Times one call of `work`, which one thread does alone: what other threads of the process do at
/// the time, looking for work, is not its own.
template <class Work>
void time_into(Series& series, std::size_t frame, const Work& work,
               clockid_t clock = CLOCK_THREAD_CPUTIME_ID) {
  const double cpu = clock_ms(clock), wall = wall_ms();
  work();
  series.add(frame, clock_ms(clock) - cpu, wall_ms() - wall);
}

/// The same, done by several threads, those of a pool.
template <class Work>
void time_all_into(Series& series, std::size_t frame, const Work& work) {
  time_into(series, frame, work, CLOCK_PROCESS_CPUTIME_ID);
}

}  // namespace pocd::bench
