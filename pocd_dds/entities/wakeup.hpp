// One thread sleeps until any of several others has something for it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace pocd::dds {

/// Thread-safe. A wake() before the wait is not lost.
class Wakeup {
 public:
  void wake() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      awake_ = true;
    }
    condition_.notify_all();
  }
  /// Returns at the next wake(), or after the time.
  void wait_for(std::chrono::milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex_);
    condition_.wait_for(lock, time, [this] { return awake_; });
    awake_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable condition_;
  bool awake_ = false;
};

}  // namespace pocd::dds
