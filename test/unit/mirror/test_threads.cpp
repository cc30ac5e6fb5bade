// The library's threads: what a program's callbacks do harms nobody else.
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <stdexcept>
#include <string>
#include <vector>

#include "mirror/callback_thread.hpp"
#include "mirror/reading_thread.hpp"

namespace pocd::dds {
namespace {

/// What callbacks wait for.
class Gate {
 public:
  void open() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      open_ = true;
    }
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    ++came_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_; });
  }
  /// Until somebody stands at it.
  void wait_for_one() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return came_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int came_ = 0;
};

/// Ten calls to a callback that hangs in the first until they are all made; what came through.
std::vector<int> called(WhenFull when_full, CallbackStatus& status) {
  std::vector<int> numbers;
  Gate gate;
  {
    CallbackThread thread({3, when_full}, [](const std::string&) {});
    thread.call([&] {
      gate.pass();
      numbers.push_back(0);
    });
    gate.wait_for_one();
    std::thread caller([&] {
      for (int i = 1; i < 10; ++i) thread.call([&numbers, i] { numbers.push_back(i); });
    });
    if (when_full == WhenFull::kWait) {
      while (thread.status().waiting < 3) std::this_thread::yield();
    } else {
      caller.join();
    }
    status = thread.status();
    gate.open();
    if (caller.joinable()) caller.join();
  }
  return numbers;
}

TEST(CallbackThread, TheProgramChoosesWhatIsDropped) {
  CallbackStatus status;
  EXPECT_EQ(called(WhenFull::kDropOldest, status), (std::vector<int>{0, 7, 8, 9}));
  EXPECT_EQ(status.dropped, 6u);
  EXPECT_EQ(status.waiting, 3u);
  EXPECT_EQ(called(WhenFull::kDropNewest, status), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(status.dropped, 6u);
  EXPECT_EQ(called(WhenFull::kWait, status), (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(status.dropped, 0u);
  EXPECT_EQ(status.waiting, 3u) << "never more than it may";
}

TEST(CallbackThread, AtTheEndNobodyWaitsAndNothingIsLost) {
  int count = 0;
  Gate gate;
  {
    CallbackThread thread({1, WhenFull::kWait}, [](const std::string&) {});
    thread.call([&] { gate.pass(); });
    gate.wait_for_one();
    thread.stop_waiting();
    for (int i = 0; i < 5; ++i) thread.call([&] { ++count; });
    gate.open();
  }
  EXPECT_EQ(count, 5);
}

TEST(CallbackThread, WhatThrowsIsSaidOnceAndCounted) {
  std::vector<std::string> said;
  int after = 0;
  CallbackStatus status;
  {
    CallbackThread thread({}, [&](const std::string& text) { said.push_back(text); });
    thread.call([] { throw std::runtime_error("no such lane"); });
    thread.call([] { throw 7; });
    thread.call([&] { ++after; });
    while (thread.status().called < 3) std::this_thread::yield();
    status = thread.status();
  }
  EXPECT_EQ(after, 1);
  EXPECT_EQ(status.failed, 2u);
  EXPECT_EQ(status.last_failure, "something that is no std::exception");
  EXPECT_EQ(said,
            std::vector<std::string>{"a callback has thrown: no such lane (said once, counted)"});
}

TEST(ReadingThread, GoesOnAfterATurnThatFails) {
  std::atomic<int> turns{0};
  std::atomic<int> said{0};
  ReadingThread thread(
      [&] {
        if (++turns % 2 == 1) throw std::runtime_error("turn " + std::to_string(turns));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      },
      [&](const std::string&) { ++said; });
  while (turns < 6) std::this_thread::yield();
  thread.stop([] {});
  EXPECT_GE(thread.failures(), 3u);
  EXPECT_EQ(thread.last_failure().rfind("turn ", 0), 0u);
  EXPECT_EQ(said, 1);
}

}  // namespace
}  // namespace pocd::dds
