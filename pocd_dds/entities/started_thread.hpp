// Threads that a library starts, and what they use of a processor.
#pragma once

#include <pthread.h>

#include <array>
#include <atomic>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

namespace pocd::dds {

/// A thread of this process that `start` starts, by its kernel id; 0 when it starts none. That
/// thread is called pocd_shm_<n>: a thread inherits the name of who starts it (pthreads(7)), and
/// meanwhile the calling one has a name that no other thread of this process has.
inline int started_by(const std::function<void()>& start) {
  static std::atomic<unsigned> next{0};
  const std::string name = "pocd_shm_" + std::to_string(next++ % 100000);  // 15 at most
  std::array<char, 16> own{};
  pthread_getname_np(pthread_self(), own.data(), own.size());
  pthread_setname_np(pthread_self(), name.c_str());
  start();
  pthread_setname_np(pthread_self(), own.data());
  std::error_code ended;
  for (std::filesystem::directory_iterator task("/proc/self/task", ended), end;
       !ended && task != end; task.increment(ended)) {
    std::string found;
    std::ifstream comm(task->path() / "comm");
    if (std::getline(comm, found) && found == name) return std::stoi(task->path().filename());
  }
  return 0;
}

/// What a thread of this process has used of a processor so far; 0 when there is no such thread.
inline std::chrono::nanoseconds processor_time(int thread) {
  // As pthread_getcpuclockid makes it, which needs a pthread_t: the clock of one thread (4) that
  // the scheduler counts (2).
  const auto clock = static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3) | 4u | 2u);
  std::timespec used{};
  if (thread == 0 || clock_gettime(clock, &used) != 0) return {};
  return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
}

}  // namespace pocd::dds
