// Calls that have not returned yet, and for how long. Without middleware; time may be given.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>

namespace pocd::dds {

/// Thread-safe, without locks: nothing waits for a call that does not return.
class OpenCalls {
 public:
  using Clock = std::chrono::steady_clock;

  /// Is open as long as it lives.
  class Call {
   public:
    explicit Call(OpenCalls& of, Clock::time_point now = Clock::now()) {
      for (std::atomic<std::int64_t>& since : of.since_) {
        std::int64_t free = kFree;
        if (!since.compare_exchange_strong(free, ns(now))) continue;
        since_ = &since;
        return;
      }
    }
    ~Call() {
      if (since_ != nullptr) *since_ = kFree;
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    std::atomic<std::int64_t>* since_ = nullptr;  // null: more calls than there is room for
  };

  /// Of the calls that are open, since when the longest has been [s]; 0 without one.
  double longest_s(Clock::time_point now = Clock::now()) const {
    std::int64_t longest = 0;
    for (const std::atomic<std::int64_t>& entry : since_) {
      const std::int64_t since = entry;
      if (since != kFree && ns(now) - since > longest) longest = ns(now) - since;
    }
    return 1e-9 * static_cast<double>(longest);
  }

 private:
  static constexpr std::int64_t kFree = -1;
  static constexpr std::size_t kMost = 64;  // a participant has about six threads that receive
  static std::int64_t ns(Clock::time_point time) {
    return std::chrono::nanoseconds(time.time_since_epoch()).count();
  }
  struct AllFree : std::array<std::atomic<std::int64_t>, kMost> {
    AllFree() {
      for (auto& entry : *this) entry = kFree;
    }
  };
  AllFree since_;
};

}  // namespace pocd::dds
