// What a large map and many robots cost on the bus: docs/bus_costs.md is written from what this
// says.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <functional>
#include <optional>
#include <thread>

#include "bus_costs_member.hpp"
#include "bus_costs_site.hpp"
#include "heap_counter.hpp"
#include "statistics.hpp"
#include "udp_profiles.hpp"

namespace pocd::benchmark {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLongestMatch_s = 150.0;

struct Options {
  double area_m2 = 10000.0, rate_mb_s = 10.0, object_period_s = 0.1, lease_s = 5.0;
  double seconds = 20.0, link_mbit = 0.0;
  int robots = 100, processes = 4, domain = 90;
};

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What this process and the network used from construction on.
class Meter {
 public:
  double seconds() const { return since(start_); }
  double cpu_s() const { return process_cost(0).cpu_s - cpu_s_; }
  double mb() const { return 1e-6 * static_cast<double>(loopback_bytes() - bytes_); }

 private:
  Clock::time_point start_ = Clock::now();
  double cpu_s_ = process_cost(0).cpu_s;
  std::uint64_t bytes_ = loopback_bytes();
};

/// Of this process, now.
struct Memory {
  double heap_mb = 1e-6 * static_cast<double>(heap_in_use());
  double resident_mb = process_cost(0).memory_mb;

  std::string text() const {
    char text[80];
    std::snprintf(text, sizeof text, "%.0f MB in use, %.0f MB resident", heap_mb, resident_mb);
    return text;
  }
};

void print_delays(const char* what, MemberReport report) {
  std::printf(
      "| object state to a robot, %s | median %.1f ms, 99 %% %.1f ms, longest %.1f ms (%.0f "
      "states) |\n",
      what, report.values["median_ms"], report.values["p99_ms"], report.values["most_ms"],
      report.values["states"]);
}

class Run {
 public:
  explicit Run(const Options& options) : options_(options) {
    std::ofstream(folder_.path() / "udp.xml") << kUdpOnly;
    config_.pipeline = scale_config();
    config_.node.map_rate_mb_s = options.rate_mb_s;
    config_.node.object_period_s = options.object_period_s;
    const auto halls = std::max(1L, std::lround(options.area_m2 / kHallArea_m2));
    site_.emplace(config_.pipeline, static_cast<int>(halls), drive_through_hall(0.8, 5));
    load_ = drive_load(*site_, config_.node.map_period_s, 0.1);
  }

  void run() {
    map();
    late_joiners();
    if (options_.robots > 0) fleet();
  }

 private:
  MemberOptions member(const std::string& kind, int participants = 1) const {
    return {options_.domain, (folder_.path() / "udp.xml").string(), kind, participants,
            options_.lease_s};
  }
  void serve_for(double seconds, int robots) {
    const auto start = Clock::now();
    publisher_->serve([&] { return since(start) >= seconds; }, load_, robots);
  }
  /// Until all of these have found the component, and it them.
  void serve_until_ready(const std::vector<Member*>& members) {
    const auto start = Clock::now();
    const auto ready = [&] {
      return std::all_of(members.begin(), members.end(), [](Member* m) { return m->ready(); });
    };
    publisher_->serve([&] { return ready() || since(start) > kLongestMatch_s; }, load_, 0);
    if (!ready()) throw std::runtime_error("listeners and component did not find each other");
  }

  void map() {
    const Memory before;
    publisher_.emplace(
        *site_, config_,
        dds::BusOptions{options_.domain, (folder_.path() / "udp.xml").string(), "costs"});
    const Meter meter;
    publisher_->publish_all();
    const dds::MapTraffic size = publisher_->map().traffic();
    const double mb = 1e-6 * static_cast<double>(size.bytes);
    std::printf(
        "\nThe map, and one robot that drives at 1.2 m/s where all is known:\n\n| | "
        "|\n|---|---|\n");
    std::printf("| floor | %.0f m2 in %d halls, %zu objects |\n", site_->halls() * kHallArea_m2,
                site_->halls(), publisher_->object_count());
    std::printf("| tiles | %zu, %.1f MB, %.0f bytes per m2 of their floor |\n", size.tiles, mb,
                static_cast<double>(size.bytes) / size.area_m2);
    std::printf("| making all of it | %.1f s of CPU |\n", meter.cpu_s());
    serve_for(1.0, 0);
    while (publisher_->map().waiting() > 0) serve_for(0.1, 0);
    const Memory published;
    std::printf("| memory: pipeline and voxels | %s |\n", before.text().c_str());
    std::printf("| memory: with publication and history | %s |\n", published.text().c_str());
    surface();
    std::printf(
        "| changed by one robot | %.1f tiles per step of %.1f s, %.1f KB/s; %.1f object states/s, "
        "%.2f events/s |\n",
        load_.tiles_per_step, config_.node.map_period_s, 1e-3 * load_.tile_bytes_per_s,
        load_.states_per_s, load_.events_per_s);
  }

  /// Somebody looks at the surface.
  void surface() {
    Member viewer(member("surface"));
    const Meter meter;
    publisher_->serve([&] { return !viewer.running(); }, load_, 0);
    const Memory after;
    const double cpu_s = meter.cpu_s();
    const TopicTraffic sum = viewer.finish().topics[dds::topics::kSurface.name];
    std::printf(
        "| rt/pocd/surface, while somebody listens | %.1f MB each time, the first time %.1f s of "
        "CPU |\n",
        1e-6 * sum.bytes / sum.messages, cpu_s);
    std::printf("| memory: after the surface was sent | %s |\n", after.text().c_str());
  }

  /// One who has nothing, while ten robots change the map and a robot waits for objects.
  void late_joiners() {
    std::printf(
        "\nA late joiner, at %.0f MB/s of map data%s, while ten robots drive:\n\n| | "
        "|\n|---|---|\n",
        options_.rate_mb_s,
        options_.link_mbit > 0 ? (" over a link of " +
                                  std::to_string(static_cast<int>(options_.link_mbit)) + " Mbit/s")
                                     .c_str()
                               : "");
    {
      Member robot(member("robot"));
      serve_until_ready({&robot});
      serve_for(5.0, 10);
      print_delays("nobody joins", robot.finish());
    }
    for (const std::string kind : {"snapshot", "tiles"}) {
      Member robot(member("robot"));
      serve_until_ready({&robot});
      const Meter meter;
      Member mirror(member(kind));
      publisher_->serve([&] { return !mirror.running(); }, load_, 10);
      const double cpu_s = meter.cpu_s(), mb = meter.mb();
      MemberReport report = mirror.finish();
      std::printf(
          "| by %s | in step after %.1f s; %.1f MB over the network; CPU %.1f s of the publisher, "
          "%.1f s of the joiner; its memory %.0f MB |\n",
          kind.c_str(), report.values["seconds"], mb, cpu_s, report.values["cpu_s"],
          report.values["memory_mb"]);
      print_delays(("one joins by " + kind).c_str(), robot.finish());
    }
  }

  void fleet() {
    std::printf("\n%d robots that listen, and change the map:\n\n| | |\n|---|---|\n",
                options_.robots);
    const Meter discovery;
    std::vector<std::unique_ptr<Member>> robots;
    std::vector<Member*> all;
    for (int i = 0; i < options_.processes; ++i) {
      const int share =
          options_.robots / options_.processes + (i < options_.robots % options_.processes);
      robots.push_back(std::make_unique<Member>(member("robot", share)));
      all.push_back(robots.back().get());
    }
    serve_until_ready(all);
    std::printf(
        "| discovery | all of %d participants in %d processes matched after %.1f s; %.1f MB |\n",
        options_.robots + 1, options_.processes + 1, discovery.seconds(), discovery.mb());
    Member listener(member("everything")), mirror(member("follow"));
    serve_until_ready({&listener, &mirror});
    serve_for(3.0, 0);  // what they get first
    const Meter rest;
    serve_for(5.0, 0);
    std::printf("| at rest | %.3f MB/s over the network, publisher %.1f %% of a core |\n",
                rest.mb() / rest.seconds(), 100.0 * rest.cpu_s() / rest.seconds());
    all.push_back(&listener);
    for (Member* m : all) m->restart();
    all.pop_back();
    load_of_the_fleet(all, listener, mirror);
    std::vector<double> p99, most;
    double memory_mb = 0.0;
    for (const auto& process : robots) {
      MemberReport report = process->finish();
      p99.push_back(report.values["p99_ms"]);
      most.push_back(report.values["most_ms"]);
      memory_mb += report.values["memory_mb"];
    }
    std::printf("| object state to a robot | 99 %% within %.0f ms, longest %.0f ms |\n",
                *std::max_element(p99.begin(), p99.end()),
                *std::max_element(most.begin(), most.end()));
    std::printf("| memory of a robot's participant | %.1f MB |\n", memory_mb / options_.robots);
  }

  void load_of_the_fleet(const std::vector<Member*>& robots, Member& listener, Member& mirror) {
    const auto cpu_of = [&] {
      double sum = 0.0;
      for (Member* m : robots) sum += m->cost().cpu_s;
      return sum;
    };
    const double robots_cpu = cpu_of(), mirror_cpu = mirror.cost().cpu_s;
    const Meter meter;
    serve_for(options_.seconds, options_.robots);
    const double seconds = meter.seconds(), mb = meter.mb(), cpu_s = meter.cpu_s();
    std::printf("| over the network, all | %.2f MB/s |\n", mb / seconds);
    std::printf("| publisher | %.0f %% of a core; with voxels and pipeline %s |\n",
                100.0 * cpu_s / seconds, Memory().text().c_str());
    std::printf("| a robot | %.2f %% of a core |\n",
                100.0 * (cpu_of() - robots_cpu) / seconds / options_.robots);
    std::printf("| a mirror | %.1f %% of a core, %.0f MB |\n",
                100.0 * (mirror.cost().cpu_s - mirror_cpu) / seconds, mirror.cost().memory_mb);
    MemberReport copy = mirror.finish(), report = listener.finish();
    std::printf("| its copy | in step in %.0f %% of the looks, %.0f gaps |\n",
                copy.values["in_step_percent"], copy.values["gaps"]);
    std::printf(
        "\nTo one who takes all topics:\n\n| topic | messages/s | KB/s |\n|---|---:|---:|\n");
    for (const auto& [name, sum] : report.topics) {
      std::printf("| %s | %.2f | %.1f |\n", name.c_str(), sum.messages / seconds,
                  1e-3 * sum.bytes / seconds);
    }
  }

  const Options options_;
  const TemporaryFolder folder_;
  NodeFile config_;
  std::optional<Site> site_;
  DriveLoad load_;
  std::optional<SitePublisher> publisher_;
};

}  // namespace
}  // namespace pocd::benchmark

int main(int argc, char** argv) {
  using namespace pocd::benchmark;  // NOLINT: a program
  CLI::App app(
      "What a large map and many robots cost on the bus.\nexample: pocd_bus_costs --robots 100",
      "pocd_bus_costs");
  Options options;
  MemberOptions member;
  app.add_option("--area", options.area_m2, "Floor of the map [m^2]")->capture_default_str();
  app.add_option("--robots", options.robots, "Robots that listen and drive")->capture_default_str();
  app.add_option("--processes", options.processes, "Processes that the robots are in")
      ->capture_default_str();
  app.add_option("--rate", options.rate_mb_s, "node.map_rate_mb_s [MB/s]")->capture_default_str();
  app.add_option("--object-period", options.object_period_s, "node.object_period_s [s]")
      ->capture_default_str();
  app.add_option(
         "--lease", options.lease_s,
         "Lease of all participants; a fifth of it is the period of their signs of life [s]")
      ->capture_default_str();
  app.add_option("--link", options.link_mbit, "Capacity of the network [Mbit/s]; 0: no limit")
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "How long the fleet is measured")
      ->capture_default_str();
  auto* listen = app.add_subcommand("member", "What this program starts")->group("");
  listen->add_option("--domain", member.domain);
  listen->add_option("--profiles", member.profiles);
  listen->add_option("--kind", member.kind);
  listen->add_option("--participants", member.participants);
  listen->add_option("--lease", member.lease_s);
  CLI11_PARSE(app, argc, argv);
  try {
    if (listen->parsed()) return run_member(member);
    setvbuf(stdout, nullptr, _IOLBF, 0);
    const std::string problem = enter_own_network(options.link_mbit);
    if (!problem.empty()) {
      std::fprintf(stderr, "pocd_bus_costs: %s: others on this machine are counted, too\n",
                   problem.c_str());
    }
    Run(options).run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pocd_bus_costs: %s\n", error.what());
    return 1;
  }
}
