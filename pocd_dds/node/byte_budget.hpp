// What may be sent now so that it leaves at a rate in the mean.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

namespace pocd::dds {

/// What nobody uses is saved for 20 ms at most. A message may overdraw it; the next ones wait for
/// longer. Time is an argument. Not thread-safe.
class ByteBudget {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit ByteBudget(double bytes_per_s) : rate_(bytes_per_s), left_(rate_ * kSavedS) {}

  bool open(Time now) {
    left_ += rate_ * std::chrono::duration<double>(now - last_).count();
    left_ = std::min(left_, rate_ * kSavedS);
    last_ = now;
    return left_ > 0.0;
  }
  void spend(std::size_t bytes) { left_ -= static_cast<double>(bytes); }

 private:
  static constexpr double kSavedS = 0.02;
  double rate_, left_;
  Time last_{};
};

}  // namespace pocd::dds
