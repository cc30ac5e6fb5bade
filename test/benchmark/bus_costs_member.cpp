#include "bus_costs_member.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <functional>
#include <stdexcept>

#include "diagnostic_msgsPubSubTypes.h"
#include "map_msgsPubSubTypes.h"
#include "nav_msgsPubSubTypes.h"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_msgsPubSubTypes.h"
#include "rmf_obstacle_msgsPubSubTypes.h"
#include "sensor_msgsPubSubTypes.h"
#include "statistics.hpp"
#include "visualization_msgsPubSubTypes.h"

namespace pocd::benchmark {
namespace {

using Clock = std::chrono::steady_clock;
using namespace pocd_msgs::msg;  // NOLINT: the topics of this file

std::atomic<bool> stopping{false}, begin_anew{false};

StampNs now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Readers of one participant.
class Listener {
 public:
  Listener(const MemberOptions& options, dds::Wakeup& wakeup)
      : bus_(std::make_shared<dds::Participant>(bus_options(options))), wakeup_(wakeup) {
    if (options.kind == "surface") {
      read<sensor_msgs::msg::PointCloud2PubSubType>(dds::topics::kSurface);
      return;
    }
    read<ObjectStatePubSubType>(dds::topics::kObjects, [this](const ObjectState& state) {
      // What was there before belongs to the history that one who joins gets.
      const StampNs sent_ns = dds::to_stamp(state.header().stamp());
      if (sent_ns >= since_ns_) delays_ms.push_back(1e-6 * static_cast<double>(now_ns() - sent_ns));
    });
    read<ObjectEventPubSubType>(dds::topics::kObjectEvents);
    read<NodeHealthPubSubType>(dds::topics::kHealth);
    if (options.kind != "everything") return;
    read<MapDeltaPubSubType>(dds::topics::kMapDeltas);
    read<MapTilePubSubType>(dds::topics::kMapTiles);
    read<MapManifestPubSubType>(dds::topics::kMapManifest);
    read<diagnostic_msgs::msg::DiagnosticArrayPubSubType>(dds::topics::kDiagnostics);
    read<visualization_msgs::msg::MarkerArrayPubSubType>(dds::topics::kMarkers);
    read<nav_msgs::msg::OccupancyGridPubSubType>(dds::topics::kOccupancy);
    read<map_msgs::msg::OccupancyGridUpdatePubSubType>(dds::topics::kOccupancyUpdates);
    read<rmf_obstacle_msgs::msg::ObstaclesPubSubType>(dds::topics::kRmfObstacles);
  }

  void take() {
    for (const auto& take : takes_) take();
  }

  bool matched() const {
    return std::all_of(readers_.begin(), readers_.end(),
                       [](const auto& reader) { return reader->matched() > 0; });
  }

  std::map<std::string, TopicTraffic> traffic;
  std::vector<double> delays_ms;

 private:
  template <class PubSubType>
  void read(const dds::TopicSpec& spec,
            std::function<void(const typename PubSubType::type&)> look = nullptr) {
    auto reader = std::make_shared<dds::Reader<PubSubType>>(bus_, spec, wakeup_);
    readers_.push_back(reader);
    takes_.push_back([this, reader, look, name = std::string(spec.name)] {
      typename PubSubType::type sample;
      dds::SampleMeta meta;
      while (reader->take(sample, meta)) {
        TopicTraffic& sum = traffic[name];
        ++sum.messages;
        if (!meta.valid) continue;
        PubSubType type;
        sum.bytes += type.getSerializedSizeProvider(&sample)();
        if (look) look(sample);
      }
    });
  }

  const StampNs since_ns_ = now_ns();
  std::shared_ptr<dds::Participant> bus_;
  dds::Wakeup& wakeup_;
  std::vector<std::shared_ptr<dds::RawReader>> readers_;
  std::vector<std::function<void()>> takes_;
};

void listen(const MemberOptions& options) {
  dds::Wakeup wakeup;
  std::vector<std::unique_ptr<Listener>> listeners;
  for (int i = 0; i < options.participants; ++i) {
    listeners.push_back(std::make_unique<Listener>(options, wakeup));
  }
  bool told = false;
  const bool once = options.kind == "surface";
  while (!stopping && !(once && !listeners.front()->traffic.empty())) {
    wakeup.wait_for(std::chrono::milliseconds(100));
    for (const auto& listener : listeners) listener->take();
    if (begin_anew.exchange(false)) {
      for (const auto& listener : listeners) listener->traffic.clear(), listener->delays_ms.clear();
    }
    if (told) continue;
    told =
        std::all_of(listeners.begin(), listeners.end(), [](const auto& l) { return l->matched(); });
    if (told) std::printf("ready 1\n");
    std::fflush(stdout);
  }
  std::vector<double> delays;
  for (const auto& listener : listeners) {
    delays.insert(delays.end(), listener->delays_ms.begin(), listener->delays_ms.end());
  }
  for (const auto& [name, sum] : listeners.front()->traffic) {
    std::printf("topic %s %.0f %.0f\n", name.c_str(), sum.messages, sum.bytes);
  }
  std::printf("states %zu\n", delays.size());
  if (delays.empty()) return;
  std::printf("median_ms %.3f\np99_ms %.3f\nmost_ms %.3f\n", bench::median(delays),
              bench::quantile(delays, 0.99), *std::max_element(delays.begin(), delays.end()));
}

int mirror(const MemberOptions& options) {
  MirrorOptions given;
  given.domain = options.domain;
  given.profiles_file = options.profiles;
  given.catch_up = options.kind == "tiles"      ? CatchUp::kTiles
                   : options.kind == "snapshot" ? CatchUp::kSnapshot
                                                : CatchUp::kEither;
  const bool go_on = options.kind == "follow";
  const auto start = Clock::now();
  const MapMirror copy(given);
  const auto whole = [](const MirrorStatus& status) {
    return status.in_step && status.version > 0;
  };
  while (!stopping && !copy.wait_until(whole, std::chrono::milliseconds(100))) {
  }
  if (!whole(copy.status()) && !go_on) return 1;
  std::printf("seconds %.2f\nready 1\n",
              std::chrono::duration<double>(Clock::now() - start).count());
  std::fflush(stdout);
  std::uint64_t turns = 0, in_step = 0;
  for (; go_on && !stopping; ++turns) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    in_step += copy.status().in_step;
  }
  if (turns > 0) {
    std::printf("in_step_percent %.1f\n",
                100.0 * static_cast<double>(in_step) / static_cast<double>(turns));
  }
  std::printf("version %llu\ngaps %llu\n", static_cast<unsigned long long>(copy.status().version),
              static_cast<unsigned long long>(copy.status().gaps));
  return 0;
}

}  // namespace

dds::BusOptions bus_options(const MemberOptions& options) {
  dds::BusOptions bus{options.domain, options.profiles, "pocd_bus_costs"};
  bus.lease_s = options.lease_s;
  return bus;
}

int run_member(const MemberOptions& options) {
  const auto stop = [](int) { stopping = true; };
  std::signal(SIGTERM, stop);
  std::signal(SIGUSR1, [](int) { begin_anew = true; });
  int result = 0;
  if (options.kind == "robot" || options.kind == "everything" || options.kind == "surface") {
    listen(options);
  } else {
    result = mirror(options);
  }
  const ProcessCost cost = process_cost(0);
  std::printf("cpu_s %.2f\nmemory_mb %.1f\n", cost.cpu_s, cost.memory_mb);
  return std::fflush(stdout) == 0 ? result : 1;
}

Member::Member(const MemberOptions& options)
    : process_({std::filesystem::read_symlink("/proc/self/exe").string(), "member", "--domain",
                std::to_string(options.domain), "--profiles", options.profiles, "--kind",
                options.kind, "--participants", std::to_string(options.participants), "--lease",
                std::to_string(options.lease_s)}) {}

MemberReport Member::finish() {
  process_.signal(SIGTERM);
  const CommandResult result = process_.wait();
  if (result.exit_code != 0)
    throw std::runtime_error("a member failed: " + result.out + result.err);
  MemberReport report;
  std::istringstream lines(result.out);
  for (std::string word; lines >> word;) {
    if (word == "topic") {
      TopicTraffic sum;
      lines >> word >> sum.messages >> sum.bytes;
      report.topics[word] = sum;
    } else {
      lines >> report.values[word];
    }
  }
  return report;
}

}  // namespace pocd::benchmark
