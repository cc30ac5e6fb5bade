// What we add to Fast DDS's transports, per packet: pocd_transport_costs --help
#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>
#include <fastdds/rtps/common/LocatorList.hpp>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <thread>

#include "pocd_dds/entities/open_calls.hpp"
#include "pocd_dds/entities/shared_memory.hpp"
#include "statistics.hpp"

namespace pocd::bench {
namespace {

namespace rtps = eprosima::fastdds::rtps;
namespace fastrtps = eprosima::fastrtps::rtps;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kSegmentBytes = 32u << 20;  // as participants have it
constexpr int kBatch = 100;                         // less than a port takes without a reader

/// Counts what arrives.
class Counter final : public rtps::TransportReceiverInterface {
 public:
  void OnDataReceived(const fastrtps::octet*, std::uint32_t, const fastrtps::Locator_t&,
                      const fastrtps::Locator_t&) override {
    ++count_;
  }
  int count() const { return count_; }

 private:
  std::atomic<int> count_{0};
};

/// One transport that sends to itself.
class Loop {
 public:
  Loop(const rtps::SharedMemTransportDescriptor& settings, std::uint32_t port)
      : transport_(settings.create_transport()) {
    fastrtps::Locator_t locator(LOCATOR_KIND_SHM, port);
    to_.push_back(locator);
    if (!transport_->init() || !transport_->OpenOutputChannel(senders_, locator) ||
        !transport_->OpenInputChannel(locator, &counter_, 65000)) {
      throw std::runtime_error("shared memory cannot be used here");
    }
  }
  ~Loop() {
    transport_->CloseInputChannel(*to_.begin());
    senders_.clear();
    transport_->shutdown();
  }

  /// Mean time of one call that sends [ns]; waits until all has arrived.
  double send(const std::vector<fastrtps::octet>& packet) {
    const int before = counter_.count();
    const auto start = Clock::now();
    for (int i = 0; i < kBatch; ++i) {
      rtps::Locators begin(to_.begin()), end(to_.end());
      senders_.front()->send(packet.data(), static_cast<std::uint32_t>(packet.size()), &begin, &end,
                             start + std::chrono::seconds(1));
    }
    const std::chrono::duration<double, std::nano> time = Clock::now() - start;
    while (counter_.count() < before + kBatch && Clock::now() - start < std::chrono::seconds(5)) {
      std::this_thread::yield();
    }
    if (counter_.count() != before + kBatch) throw std::runtime_error("packets were lost");
    return time.count() / kBatch;
  }

 private:
  Counter counter_;
  std::unique_ptr<rtps::TransportInterface> transport_;
  rtps::SendResourceList senders_;
  rtps::LocatorList to_;
};

void print(const char* what, const std::vector<double>& ns) {
  std::printf("%-44s %8.0f %8.0f %8.0f\n", what, quantile(ns, 0.1), median(ns), quantile(ns, 0.9));
}

/// In turns, so that what else the machine does meets both.
void compare_sending(std::size_t bytes, int batches) {
  rtps::SharedMemTransportDescriptor settings;
  settings.segment_size(kSegmentBytes);
  Loop plain(settings, 17001), lasting(dds::LastingSharedMemory(settings), 17002);
  const std::vector<fastrtps::octet> packet(bytes, 7);
  std::vector<double> without, with;
  for (int i = 0; i < batches; ++i) {
    without.push_back(plain.send(packet));
    with.push_back(lasting.send(packet));
  }
  const std::string size = std::to_string(bytes) + " bytes to one port, ";
  print((size + "Fast DDS's").c_str(), without);
  print((size + "ours").c_str(), with);
}

/// As around each message that is received.
void time_watch(int batches) {
  dds::OpenCalls calls;
  std::vector<double> ns;
  for (int i = 0; i < batches; ++i) {
    const auto start = Clock::now();
    for (int k = 0; k < kBatch; ++k) const dds::OpenCalls::Call call(calls);
    ns.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count() / kBatch);
  }
  print("watching that a message is taken", ns);
}

}  // namespace
}  // namespace pocd::bench

int main(int argc, char** argv) {
  CLI::App app(
      "What the component adds to Fast DDS's transports: sending by shared memory that goes on "
      "when "
      "a process is killed, beside Fast DDS's own, and the watch over discovery around each "
      "message that is received. Uses /dev/shm, no participant.\n"
      "Prints ns per packet: the 10 % that were fastest, the median, and what 90 % stayed below.",
      "pocd_transport_costs");
  int batches = 2000;
  std::vector<std::size_t> sizes{200, 60000};
  app.add_option("--batches", batches, "Of 100 packets each")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--bytes", sizes, "Sizes of packets; repeat it for several")
      ->check(CLI::Range(1, 65000))
      ->allow_extra_args(false)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    std::printf("%-44s %8s %8s %8s\n", "[ns]", "10 %", "median", "90 %");
    for (const std::size_t bytes : sizes) pocd::bench::compare_sending(bytes, batches);
    pocd::bench::time_watch(batches);
  } catch (const std::exception& error) {
    std::cerr << "pocd_transport_costs: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
