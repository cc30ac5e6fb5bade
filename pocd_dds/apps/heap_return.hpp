// Memory that a program does not use any more goes back to the system.
#pragma once

#include <malloc.h>

#include <chrono>

namespace pocd::dds {

/// glibc keeps what was freed between what is in use, in one heap for nearly every thread: a
/// program that runs for months with images of many sizes grows by that, though it needs no more.
/// This gives whole pages of it back. Of one thread.
class HeapReturn {
 public:
  using Clock = std::chrono::steady_clock;

  explicit HeapReturn(Clock::time_point start = Clock::now()) : last_(start) {}

  /// Once a minute; true when it was time for that.
  bool turn(Clock::time_point now = Clock::now()) {
    if (now - last_ < std::chrono::minutes(1)) return false;
    last_ = now;
    malloc_trim(0);
    return true;
  }

 private:
  Clock::time_point last_;
};

}  // namespace pocd::dds
