// One thread sleeps until any of several others has something for it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace pocd::dds {

/// Thread-safe. A wake() before the wait is not lost.
class Wakeup {
 public:
  Wakeup() = default;
  /// One of the sources of `sleeper`: whoever wakes this one wakes that one, too. `sleeper` has to
  /// outlive it.
  explicit Wakeup(Wakeup& sleeper) : sleeper_(&sleeper) {}
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  void wake() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      awake_ = true;
    }
    condition_.notify_all();
    if (sleeper_ != nullptr) sleeper_->wake();
  }
  /// Returns at the next wake(), or after the time.
  void wait_for(std::chrono::milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex_);
    condition_.wait_for(lock, time, [this] { return awake_; });
    awake_ = false;
  }
  /// Does not wait: whether wake() was called since the last time.
  bool take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(awake_, false);
  }

 private:
  std::mutex mutex_;
  std::condition_variable condition_;
  bool awake_ = false;
  Wakeup* const sleeper_ = nullptr;
};

}  // namespace pocd::dds
