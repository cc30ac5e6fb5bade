// Says when Fast DDS's discovery hangs.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "pocd_dds/entities/open_calls.hpp"
#include "pocd_dds/entities/stall_note.hpp"
#include "pocd_dds/entities/wakeup.hpp"

namespace pocd::dds {

/// Looks once a second at the messages that Fast DDS has not taken yet (watched_transport.hpp), on
/// a thread of its own: whoever uses the participant may hang with it. Thread-safe.
class DiscoveryWatch {
 public:
  /// `name`: of the participant, for the log. It hangs from `stall_s` on [s].
  DiscoveryWatch(const std::string& name, double stall_s);
  ~DiscoveryWatch();
  DiscoveryWatch(const DiscoveryWatch&) = delete;
  DiscoveryWatch& operator=(const DiscoveryWatch&) = delete;

  const std::shared_ptr<OpenCalls>& calls() const { return calls_; }
  /// For how long a message has not been taken [s]. Never waits.
  double still_s() const { return calls_->longest_s(); }
  bool hangs() const { return still_s() >= stall_s_; }
  /// How often it has begun to hang.
  std::uint64_t stalls() const { return note_.stalls(); }

 private:
  void look_after();

  const double stall_s_;
  const std::shared_ptr<OpenCalls> calls_ = std::make_shared<OpenCalls>();
  StallNote note_;
  Wakeup wakeup_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace pocd::dds
