// A thread that reads from the bus for a program, and that no failure ends. Without middleware.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace pocd::dds {

/// Thread-safe.
class ReadingThread {
 public:
  /// Takes `turn` after `turn`, each of which waits for something to do, until stop(). What a turn
  /// throws is counted, and the first failure told.
  ReadingThread(std::function<void()> turn, std::function<void(const std::string&)> told)
      : turn_(std::move(turn)), told_(std::move(told)), thread_([this] { run(); }) {}
  ~ReadingThread() {
    stop([] {});
  }

  /// `wake` has to end a turn that waits.
  template <class Wake>
  void stop(const Wake& wake) {
    stopping_ = true;
    wake();
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t failures() const { return failures_; }
  std::string last_failure() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return last_failure_;
  }

 private:
  void run() {
    while (!stopping_) {
      std::string failure;
      try {
        turn_();
        continue;
      } catch (const std::exception& error) {
        failure = error.what();
      } catch (...) {
        failure = "something that is no std::exception";
      }
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        last_failure_ = failure;
      }
      if (failures_++ == 0) told_("reading has failed: " + failure + " (said once, counted)");
    }
  }

  const std::function<void()> turn_;
  const std::function<void(const std::string&)> told_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> failures_{0};
  mutable std::mutex mutex_;  // guards what follows
  std::string last_failure_;
  std::thread thread_;
};

}  // namespace pocd::dds
