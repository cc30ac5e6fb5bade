// Whether a thread that receives from shared memory works without receiving anything.
#pragma once

#include <fastdds/rtps/transport/TransportReceiverInterface.h>

#include <atomic>
#include <chrono>
#include <cstdint>

#include "pocd_dds/entities/started_thread.hpp"

namespace pocd::dds {

/// Stands between a port of shared memory and who receives from it. Each channel that is opened
/// needs a new one. turns() may be called beside OnDataReceived.
///
/// A message in a port only names the segment of its sender. Fast DDS 2.9.1 gives up the segments
/// of a process that ends, and some seconds later those of one that was killed. Who was held up
/// meanwhile, or has just started, finds a message of that process, cannot open its segment, and
/// asks for the same message again, without an end: the thread uses a processor and receives
/// nothing more (ros2cli #582, Fast-DDS #2398).
class ReceivingThread final : public eprosima::fastdds::rtps::TransportReceiverInterface {
 public:
  using Octet = eprosima::fastrtps::rtps::octet;
  using Locator = eprosima::fastrtps::rtps::Locator_t;

  explicit ReceivingThread(TransportReceiverInterface* next) : next_(next) {}

  /// `thread` is the one that calls OnDataReceived, by its kernel id (started_thread.hpp). To be
  /// called once, before the first call of turns(): a thread that turns from its start on never
  /// shows itself.
  void set_thread(int thread) { thread_ = thread; }

  void OnDataReceived(const Octet* data, const std::uint32_t size, const Locator& local,
                      const Locator& remote) override {
    within_ = true;
    next_->OnDataReceived(data, size, local, remote);
    ++received_;
    within_ = false;
  }

  /// To be asked once a second, by one thread: true from the third call in a row on of which each
  /// finds that it has worked since the call before and received nothing.
  bool turns() {
    const std::uint64_t received = received_;
    const std::chrono::nanoseconds worked = processor_time(thread_);
    const bool idle = within_ || received != last_received_ || worked - last_worked_ < kWork;
    last_received_ = received;
    last_worked_ = worked;
    looks_ = idle ? 0 : looks_ + 1;
    return looks_ >= kLooks;
  }

 private:
  /// One that waits uses next to nothing; of a busy machine, one that turns gets a part.
  static constexpr std::chrono::milliseconds kWork{50};
  static constexpr int kLooks = 3;

  TransportReceiverInterface* const next_;
  int thread_ = 0;
  std::atomic<bool> within_{false};
  std::atomic<std::uint64_t> received_{0};
  // Of who asks.
  std::uint64_t last_received_ = 0;
  std::chrono::nanoseconds last_worked_{};
  int looks_ = 0;
};

}  // namespace pocd::dds
