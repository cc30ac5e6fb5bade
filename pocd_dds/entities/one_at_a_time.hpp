// One process of a host at a time.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

namespace pocd::dds {

/// Two processes that start at once must not both take the room that is there for one.
class OneAtATime {
 public:
  explicit OneAtATime(const std::filesystem::path& folder)
      : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    // Not for ever: one that stands still would hold up all others.
    for (int i = 0; i < 200 && descriptor_ >= 0 && flock(descriptor_, LOCK_EX | LOCK_NB) != 0;
         ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  ~OneAtATime() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OneAtATime(const OneAtATime&) = delete;
  OneAtATime& operator=(const OneAtATime&) = delete;

 private:
  int descriptor_;
};

}  // namespace pocd::dds
