#include "pocd_dds/entities/discovery_watch.hpp"

#include <pthread.h>

#include <chrono>

#include "pocd_dds/entities/bus_log.hpp"

namespace pocd::dds {
namespace {

constexpr std::chrono::seconds kLook{1};

}  // namespace

DiscoveryWatch::DiscoveryWatch(const std::string& name, double stall_s)
    : stall_s_(stall_s),
      note_(name + ": Fast DDS's discovery",
            "nobody is found or heard any more; start this process anew (docs/operating.md, "
            "Fast-DDS #6502)",
            stall_s),
      thread_([this] { look_after(); }) {}

DiscoveryWatch::~DiscoveryWatch() {
  ending_ = true;
  wakeup_.wake();
  thread_.join();
}

void DiscoveryWatch::look_after() {
  pthread_setname_np(pthread_self(), "pocd_watch");
  while (!ending_) {
    wakeup_.wait_for(kLook);
    const auto word = note_.look(calls_->longest_s());
    if (word) log(word->hangs ? LogLevel::kError : LogLevel::kWarning, word->text);
  }
}

}  // namespace pocd::dds
