// When a copy of which the publisher is not heard any more joins the bus anew. Without middleware;
// time is an argument.
#pragma once

#include <algorithm>
#include <chrono>

namespace pocd::dds {

/// After an overload or a cut, Fast DDS may have lost a participant on one side only, or keep ports
/// that nobody writes to: then two that live never hear each other again. A new participant is
/// found anew by everybody. Where the publisher has really gone it does no harm, but costs others a
/// discovery: less and less often. Not thread-safe.
class RejoinPlan {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;
  /// Well above the lease, after which a loss that heals by itself has healed.
  static constexpr std::chrono::seconds kFirst{15};
  static constexpr std::chrono::seconds kMost{240};

  /// Nothing was heard for `silence` of a publisher that has not ended its run. True: join anew
  /// now.
  bool due(Time now, Duration silence) {
    if (silence < kFirst) {
      next_ = Time::min();
      wait_ = kFirst;
      return false;
    }
    if (now < next_) return false;
    next_ = now + wait_;
    wait_ = std::min<Duration>(2 * wait_, kMost);
    return true;
  }

 private:
  Time next_ = Time::min();
  Duration wait_ = kFirst;
};

}  // namespace pocd::dds
