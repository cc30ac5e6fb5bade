// What a large map and many robots cost on the bus.
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <set>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/datasets/dataset_reader.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd_dds/node/map_publication.hpp"

extern char** environ;

namespace pocd {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}
double cpu_s(const rusage& usage) {
  const auto s = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return s(usage.ru_utime) + s(usage.ru_stime);
}
double own_cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return cpu_s(usage);
}
double resident_mb() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

struct Options {
  std::string scenario = "config/sim/demo.yaml", config = "config/simulated.yaml", mirror;
  double area_m2 = 10000.0, rate_mb_s = 10.0, seconds = 20.0;
  int robots = 100, domain = 90;
  std::size_t max_frames = 100000;
};

/// What one robot changes in the map of the scenario, from a run of the pipeline.
struct Scenario {
  std::vector<std::pair<BlockKey, VoxelBlock>> blocks;
  double tiles_per_step = 0.0, bytes_per_step = 0.0;  ///< in the last third, per robot
};

Scenario run_scenario(const Options& options, dds::NodeFile& file) {
  load_config(file, {options.config});
  DatasetOptions dataset;
  dataset.format = "sim";
  dataset.inputs = {options.scenario};
  dataset.classes = file.pipeline.classes;
  dataset.with_color = false;
  const auto reader = open_dataset(dataset);
  PocdPipeline pipeline(file.pipeline);
  MapPublisher publisher(1, file.pipeline.map);
  std::set<std::string> robots;
  std::vector<std::pair<std::size_t, std::size_t>> steps;
  StampNs next_ns = 0;
  std::size_t frames = 0;
  while (frames++ < options.max_frames) {
    const std::optional<Frame> frame = reader->next();
    if (!frame) break;
    robots.insert(frame->robot);
    pipeline.process_frame(*frame);
    if (frame->stamp_ns < next_ns) continue;
    next_ns = frame->stamp_ns + static_cast<StampNs>(1e9 * file.node.map_period_s);
    const auto delta = publisher.update(pipeline.map());
    std::size_t bytes = 0;
    if (delta)
      for (const MapTile& tile : delta->changed) bytes += tile.payload.size();
    steps.emplace_back(delta ? delta->changed.size() : 0, bytes);
  }
  publisher.update(pipeline.map());
  Scenario scenario;
  for (const BlockKey& key : pipeline.map().sorted_keys()) {
    scenario.blocks.emplace_back(key, *pipeline.map().find(key));
  }
  const std::size_t from = 2 * steps.size() / 3;
  for (std::size_t i = from; i < steps.size(); ++i) {
    scenario.tiles_per_step += static_cast<double>(steps[i].first);
    scenario.bytes_per_step += static_cast<double>(steps[i].second);
  }
  const double runs = static_cast<double>((steps.size() - from));
  // Robots of the demonstration drive one after the other: a step is one robot's.
  scenario.tiles_per_step /= runs;
  scenario.bytes_per_step /= runs;
  std::printf("scenario: %zu frames, %zu robots, %zu tiles, %.0f m2, %.0f bytes per m2\n",
              frames - 1, robots.size(), publisher.tiles().size(), publisher.area_m2(),
              static_cast<double>(publisher.bytes()) / publisher.area_m2());
  std::printf("one robot in a known place: %.1f tiles and %.0f bytes per step of %.1f s\n",
              scenario.tiles_per_step, scenario.bytes_per_step, file.node.map_period_s);
  return scenario;
}

/// Copies of the scenario side by side until they cover the area.
void tile_floor(const Scenario& scenario, const Options& options, double scenario_m2,
                TsdfMap& map) {
  BlockKey low = scenario.blocks[0].first, high = low;
  for (const auto& [key, block] : scenario.blocks) {
    low = {std::min(low.x, key.x), std::min(low.y, key.y), 0};
    high = {std::max(high.x, key.x), std::max(high.y, key.y), 0};
  }
  // Whole tiles, so that a copy has the bytes of the original.
  const auto even = [](std::int32_t n) { return (n + 2) & ~1; };
  const std::int32_t dx = even(high.x - low.x), dy = even(high.y - low.y);
  const int copies = static_cast<int>(std::ceil(options.area_m2 / scenario_m2));
  const int columns = static_cast<int>(std::ceil(std::sqrt(copies * double(dy) / dx)));
  for (int i = 0; i < copies; ++i) {
    for (const auto& [key, block] : scenario.blocks) {
      const BlockKey at{key.x + dx * (i % columns), key.y + dy * (i / columns), key.z};
      VoxelBlock& copy = map.touch(at);
      copy.tsdf = block.tsdf;
      copy.weight = block.weight;
      copy.owner = block.owner;
    }
  }
}

class LargeMap {
 public:
  LargeMap(const Options& options, const dds::NodeFile& file, const Scenario& scenario,
           double scenario_m2)
      : map_(file.pipeline.map) {
    const double before_mb = resident_mb();
    tile_floor(scenario, options, scenario_m2, map_);
    std::printf("voxels: %zu blocks, %.0f MB\n", map_.block_count(), resident_mb() - before_mb);
    participant_ =
        std::make_shared<dds::Participant>(dds::BusOptions{options.domain, "", "pocd_bus_costs"});
    dds::NodeFile with_rate = file;
    with_rate.node.map_rate_mb_s = options.rate_mb_s;
    publication_.emplace(participant_, with_rate, 1, wakeup_);
    const double map_mb = resident_mb(), cpu = own_cpu_s();
    publication_->send_due(map_, 1, true);
    const dds::MapTraffic size = publication_->traffic();
    std::printf("map: %zu tiles, %.0f m2, %.2f MB, %.0f bytes per m2\n", size.tiles, size.area_m2,
                1e-6 * static_cast<double>(size.bytes),
                static_cast<double>(size.bytes) / size.area_m2);
    std::printf("publishing all of it at once: %.2f s CPU, %.0f MB for tiles and history\n",
                own_cpu_s() - cpu, resident_mb() - map_mb);
  }

  /// Serves until `done`; changes `tiles` random tiles per period.
  void serve(const std::function<bool()>& done, double tiles, double period_s) {
    const auto keys = map_.sorted_keys();
    auto stepped = Clock::now(), told = Clock::time_point{};
    while (!done()) {
      wakeup_.wait_for(std::chrono::milliseconds(5));
      publication_->answer_requests();
      publication_->send_waiting();
      if (seconds_since(told) >= 1.0) publication_->send_manifest(0, false), told = Clock::now();
      if (tiles <= 0 || seconds_since(stepped) < period_s) continue;
      stepped = Clock::now();
      for (int i = 0; i < static_cast<int>(tiles); ++i) {
        // The next observation of a surface moves it by a step or two of the quantisation.
        VoxelBlock& block = map_.touch(keys[random_.below(keys.size())]);
        for (std::int16_t& d : block.tsdf) {
          if (d < 29000 && d > -32000) {
            d = static_cast<std::int16_t>(d + static_cast<int>(random_.below(600)) - 300);
          }
        }
      }
      publication_->send_due(map_, 1, false);
    }
  }
  dds::MapPublication& publication() { return *publication_; }

 private:
  TsdfMap map_;
  Random random_{1};
  dds::Wakeup wakeup_;
  std::shared_ptr<dds::Participant> participant_;
  std::optional<dds::MapPublication> publication_;
};

/// A mirror in a process of its own.
class Mirror {
 public:
  Mirror(const Options& options, std::vector<std::string> arguments) : start_(Clock::now()) {
    arguments.insert(arguments.begin(),
                     {options.mirror, "--domain", std::to_string(options.domain)});
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    if (posix_spawn(&pid_, argv[0], nullptr, nullptr, argv.data(), environ) != 0) {
      throw InputError("cannot run " + options.mirror);
    }
  }
  bool done() {
    if (finished_) return true;
    int status = 0;
    finished_ = wait4(pid_, &status, WNOHANG, &usage_) == pid_;
    if (finished_) seconds_ = seconds_since(start_);
    return finished_;
  }
  void report(const std::string& what) const {
    std::printf("%s: %.1f s, its CPU %.2f s, its memory %.0f MB\n", what.c_str(), seconds_,
                cpu_s(usage_), static_cast<double>(usage_.ru_maxrss) * 1e-3);
  }

 private:
  Clock::time_point start_;
  pid_t pid_ = 0;
  bool finished_ = false;
  rusage usage_{};
  double seconds_ = 0.0;
};

int large_map(const Options& options) {
  dds::NodeFile file;
  const Scenario scenario = run_scenario(options, file);
  TsdfMap one(file.pipeline.map);
  MapPublisher measure(1, file.pipeline.map);
  for (const auto& [key, block] : scenario.blocks) one.touch(key) = block;
  measure.update(one);
  LargeMap map(options, file, scenario, measure.area_m2());
  for (const std::string means : {"tiles", "snapshot"}) {
    const double cpu = own_cpu_s();
    Mirror mirror(options, {"--until-in-step", "--catch-up", means, "--timeout", "300"});
    map.serve([&] { return mirror.done(); }, 0, 0);
    mirror.report("a late joiner by " + means + " at " + std::to_string(options.rate_mb_s) +
                  " MB/s");
    std::printf("  the publisher's CPU meanwhile %.2f s\n", own_cpu_s() - cpu);
  }
  const double tiles = scenario.tiles_per_step * options.robots;
  Mirror mirror(options, {"--timeout", std::to_string(options.seconds)});
  const std::uint64_t before = map.publication().traffic().step_bytes;
  const double cpu = own_cpu_s();
  const auto start = Clock::now();
  map.serve([&] { return mirror.done(); }, tiles, file.node.map_period_s);
  const double time = seconds_since(start);
  std::printf(
      "%d robots: %.0f changed tiles per step, %.2f MB/s of deltas, publisher %.0f %% CPU\n",
      options.robots, tiles,
      1e-6 * static_cast<double>(map.publication().traffic().step_bytes - before) / time,
      100.0 * (own_cpu_s() - cpu) / time);
  mirror.report("a mirror that joins and follows");
  return 0;
}

std::uint64_t loopback_bytes() {
  std::ifstream in("/proc/net/dev");
  std::string line;
  while (std::getline(in, line)) {
    const auto at = line.find("lo:");
    if (at != std::string::npos) return std::stoull(line.substr(at + 3));
  }
  return 0;
}

/// Participants with the endpoints of a robot each, and one with those of the node.
int discovery(const Options& options) {
  const std::uint64_t before = loopback_bytes();
  const auto start = Clock::now();
  const double cpu = own_cpu_s();
  dds::Wakeup wakeup;
  const auto participant = [&] {
    return std::make_shared<dds::Participant>(dds::BusOptions{options.domain, "", "robot"});
  };
  dds::Writer<pocd_msgs::msg::ObjectStatePubSubType> objects(participant(), dds::topics::kObjects);
  dds::Writer<pocd_msgs::msg::ObjectEventPubSubType> events(participant(),
                                                            dds::topics::kObjectEvents);
  std::vector<std::unique_ptr<dds::RawReader>> readers;
  std::vector<std::unique_ptr<dds::RawWriter>> writers;
  for (int i = 0; i < options.robots; ++i) {
    const auto bus = participant();
    readers.push_back(std::make_unique<dds::Reader<pocd_msgs::msg::ObjectStatePubSubType>>(
        bus, dds::topics::kObjects, wakeup));
    readers.push_back(std::make_unique<dds::Reader<pocd_msgs::msg::ObjectEventPubSubType>>(
        bus, dds::topics::kObjectEvents, wakeup));
    writers.push_back(std::make_unique<dds::Writer<pocd_msgs::msg::NodeHealthPubSubType>>(
        bus, dds::topics::kHealth));
  }
  while ((objects.matched() < options.robots || events.matched() < options.robots) &&
         seconds_since(start) < 300) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::printf(
      "%d participants: all matched after %.1f s, %.1f MB over loopback, %.1f s CPU, %.0f MB\n",
      options.robots + 2, seconds_since(start),
      1e-6 * static_cast<double>(loopback_bytes() - before), own_cpu_s() - cpu, resident_mb());
  const std::uint64_t settled = loopback_bytes();
  std::this_thread::sleep_for(std::chrono::duration<double>(options.seconds));
  std::printf("at rest: %.3f MB/s over loopback\n",
              1e-6 * static_cast<double>(loopback_bytes() - settled) / options.seconds);
  return objects.matched() == options.robots ? 0 : 1;
}

}  // namespace
}  // namespace pocd

int main(int argc, char** argv) {
  CLI::App app("Costs of a large map and of many robots on the bus.", "pocd_bus_costs");
  pocd::Options options;
  app.require_subcommand(1);
  app.add_option("--domain", options.domain);
  app.add_option("--robots", options.robots);
  app.add_option("--seconds", options.seconds, "How long the running cost is measured");
  auto* map = app.add_subcommand("map", "Tiles a simulated place over a large floor");
  map->add_option("--scenario", options.scenario);
  map->add_option("--config", options.config);
  map->add_option("--area", options.area_m2, "Floor [m^2]");
  map->add_option("--rate", options.rate_mb_s, "node.map_rate_mb_s [MB/s]");
  map->add_option("--max-frames", options.max_frames);
  auto* discovery = app.add_subcommand("discovery", "Participants that find each other");
  app.fallthrough();
  CLI11_PARSE(app, argc, argv);
  options.mirror =
      std::string(argv[0]).substr(0, std::string(argv[0]).find_last_of('/') + 1) + "pocd_mirror";
  setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    return discovery->parsed() ? pocd::discovery(options) : pocd::large_map(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pocd_bus_costs: %s\n", error.what());
    return 1;
  }
}
