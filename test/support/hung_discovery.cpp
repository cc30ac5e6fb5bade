// Loaded into a program before its libraries (LD_PRELOAD): while the file that POCD_HANG_FILE names
// exists, Fast DDS's discovery stands still as in Fast-DDS #6502. The thread that takes a message
// holds the real lock of discovery and does not give it back.
#include <dlfcn.h>
#include <fastdds/rtps/builtin/discovery/participant/PDP.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <mutex>
#include <thread>

namespace eprosima::fastrtps::rtps {

void PDP::assert_remote_participant_liveliness(const GuidPrefix_t& from) {
  using Function = void (*)(PDP*, const GuidPrefix_t&);
  static const auto real = reinterpret_cast<Function>(
      dlsym(RTLD_NEXT,
            "_ZN8eprosima8fastrtps4rtps3PDP36assert_remote_participant_livelinessERKNS1_12Guid"
            "Prefix_tE"));
  static const char* const file = std::getenv("POCD_HANG_FILE");
  if (file != nullptr && access(file, F_OK) == 0) {
    const std::lock_guard<std::recursive_mutex> lock(*getMutex());
    while (access(file, F_OK) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  real(this, from);
}

}  // namespace eprosima::fastrtps::rtps
