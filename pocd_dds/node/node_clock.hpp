// The time that outputs are stamped and paced with.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>

#include "pocd/common/types.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "rosgraph_msgsPubSubTypes.h"

namespace pocd::dds {

/// The wall clock, or what a replay says on rt/clock, so that those who live in its time (ROS:
/// use_sim_time) find stamps of their own time. Thread-safe.
class NodeClock {
 public:
  NodeClock(const std::shared_ptr<Participant>& participant, bool use_clock, Wakeup& wakeup) {
    if (!use_clock) return;
    reader_ = std::make_unique<Reader<rosgraph_msgs::msg::ClockPubSubType>>(
        participant, topics::kClock, topics::kClock.name, topics::best_effort(1), wakeup);
  }

  /// 0 as long as a replay has said nothing.
  StampNs now_ns() {
    if (!reader_) {
      return std::chrono::duration_cast<std::chrono::nanoseconds>(
                 std::chrono::system_clock::now().time_since_epoch())
          .count();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    constexpr int kMost = 100;  // of one turn
    reader_->take_some(kMost, [&](const auto& message, const SampleMeta& meta) {
      if (meta.valid) heard_ns_ = to_stamp(message.clock());
    });
    return heard_ns_;
  }
  /// What of the replay's clock could not be heard or read.
  void count_problems(ProblemCounter& problems) {
    if (!reader_) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    problems.count_incompatible(*reader_);
    problems.count_damaged(*reader_);
  }

 private:
  std::unique_ptr<Reader<rosgraph_msgs::msg::ClockPubSubType>> reader_;
  std::mutex mutex_;
  StampNs heard_ns_ = 0;
};

/// Says when something with a rate is due. A clock that jumps back, as at the start of a replay's
/// next round, makes it due at once.
class Pace {
 public:
  explicit Pace(double rate_hz)
      : period_ns_(rate_hz > 0.0 ? static_cast<StampNs>(1e9 / rate_hz) : 0) {}

  bool off() const { return period_ns_ == 0; }
  /// True, and the next period begins.
  bool due(StampNs now_ns) {
    if (off() || now_ns == 0) return false;
    if (last_ns_ != 0 && now_ns >= last_ns_ && now_ns - last_ns_ < period_ns_) return false;
    last_ns_ = now_ns;
    return true;
  }

 private:
  StampNs period_ns_;
  StampNs last_ns_ = 0;
};

}  // namespace pocd::dds
