// Calls a program back by a thread of its own, so that a callback that is slow or throws harms
// nobody but itself. Without middleware.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "pocd_dds/callbacks.hpp"

namespace pocd::dds {

/// Thread-safe.
class CallbackThread {
 public:
  /// `told` hears of the first call that throws and of the first that is dropped.
  CallbackThread(const CallbackOptions& options, std::function<void(const std::string&)> told)
      : most_(std::max<std::size_t>(options.most_waiting, 1)),
        when_full_(options.when_full),
        told_(std::move(told)),
        thread_([this] { run(); }) {}
  /// What waits is still called.
  ~CallbackThread() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  CallbackThread(const CallbackThread&) = delete;
  CallbackThread& operator=(const CallbackThread&) = delete;

  /// Calls are made one at a time, in this order. Throws nothing but std::bad_alloc.
  void call(std::function<void()> call) {
    bool first_dropped = false;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      if (waiting_.size() >= most_) {
        switch (when_full_) {
          case WhenFull::kWait:
            changed_.wait(lock, [this] { return waiting_.size() < most_ || hurrying_; });
            break;
          case WhenFull::kDropOldest:
            waiting_.pop_front();
            first_dropped = status_.dropped++ == 0;
            break;
          case WhenFull::kDropNewest:
            first_dropped = status_.dropped++ == 0;
            break;
        }
      }
      if (waiting_.size() < most_ || when_full_ == WhenFull::kWait) {
        waiting_.push_back(std::move(call));
      }
    }
    changed_.notify_all();
    if (first_dropped) told_("callbacks are too slow: calls are dropped (said once, counted)");
  }
  /// No call() waits for room any more. For the end: what is full then grows by what is still put
  /// in.
  void stop_waiting() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      hurrying_ = true;
    }
    changed_.notify_all();
  }
  CallbackStatus status() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    CallbackStatus status = status_;
    status.waiting = waiting_.size();
    return status;
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const std::function<void()> call = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      changed_.notify_all();
      const std::string failure = outcome_of(call);
      lock.lock();
      ++status_.called;
      if (failure.empty()) continue;
      status_.last_failure = failure;
      if (status_.failed++ > 0) continue;
      lock.unlock();
      told_("a callback has thrown: " + failure + " (said once, counted)");
      lock.lock();
    }
  }
  static std::string outcome_of(const std::function<void()>& call) {
    try {
      call();
      return "";
    } catch (const std::exception& error) {
      return *error.what() != '\0' ? error.what() : "exception without a text";
    } catch (...) {
      return "something that is no std::exception";
    }
  }

  const std::size_t most_;
  const WhenFull when_full_;
  const std::function<void(const std::string&)> told_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  CallbackStatus status_;
  bool hurrying_ = false, ending_ = false;
  std::thread thread_;
};

}  // namespace pocd::dds
