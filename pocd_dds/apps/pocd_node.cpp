// The component: camera, segmentation and odometry topics in, objects and map deltas out.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <random>

#include "apps/common.hpp"
#include "apps/heap_return.hpp"
#include "apps/service_notice.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd_dds/node/node.hpp"
#include "pocd_dds/watch/health_line.hpp"
#include "pocd_dds/watch/health_socket.hpp"
#include "pocd_dds/watch/metrics_endpoint.hpp"

namespace {

std::uint64_t random_epoch() {
  std::random_device device;
  const std::uint64_t epoch = std::uint64_t{device()} << 32 | device();
  return epoch == 0 ? 1 : epoch;
}

/// The group of the configuration that pocd_parameters does not know.
struct NodeGroup {
  pocd::NodeConfig node;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.group("node", node, "The component on the bus.");
  }
};

std::unique_ptr<pocd::dds::MetricsEndpoint> metrics_at(const std::string& address,
                                                       const pocd::dds::NodeOptions& node) {
  if (address.empty()) return nullptr;
  pocd::dds::MetricsOptions options{address, node.bus.name, POCD_VERSION, node.epoch};
  auto endpoint = std::make_unique<pocd::dds::MetricsEndpoint>(options);
  spdlog::info("metrics on port {}", endpoint->port());
  return endpoint;
}

/// Null, which is said, where none can be made: pocd_health asks on the bus then.
std::unique_ptr<pocd::dds::HealthSocket> socket_at(const std::filesystem::path& path) {
  if (path.empty()) return nullptr;
  try {
    return std::make_unique<pocd::dds::HealthSocket>(path);
  } catch (const pocd::InputError& error) {
    spdlog::warn("--health-socket: {}", error.what());
    return nullptr;
  }
}

constexpr const char* kParametersIntroduction =
    "# Parameters of pocd_node\n\n"
    "Written by `pocd_node --parameters`; do not edit. They are given in the same files as the\n"
    "[parameters of the pipeline](parameters.md), under `node`.\n";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Maps what the robots' cameras see and publishes what changes.\n"
      "Example: pocd_node --config config/simulated.yaml --robot robot_1 --robot robot_2\n"
      "Without a named robot, it listens to every robot that appears on the bus.\n"
      "Runs until SIGINT, SIGTERM or SIGHUP, then publishes its last state.\n"
      "Exit code: 0 ended in order, 1 the bus failed or subscribers did not acknowledge the last "
      "state, 2 usage or configuration.",
      "pocd_node");
  pocd::dds::NodeOptions options;
  options.bus.name = "pocd_node";
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides, robots;
  std::optional<std::uint64_t> epoch;
  bool dump = false, show_parameters = false;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--config", files, "Configuration file; repeat it to overlay several")
      ->allow_extra_args(false);
  app.add_option("--set", overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--robot", robots,
                 "Listen to this robot, {robot} in the topics; one that node.robots has keeps its "
                 "entry there; repeat it for several")
      ->allow_extra_args(false);
  app.add_flag_callback(
      "--lossless", [&] { overrides.push_back("node.lossless=true"); },
      "Hold the player back instead of dropping frames (replays)");
  app.add_option("--name", options.bus.name, "Name of this node in health and diagnostics")
      ->envname("POCD_NAME")
      ->capture_default_str();
  app.add_option("--epoch", epoch, "Name of this run; default: random. Never use one twice")
      ->check(CLI::Range(std::uint64_t{1}, ~std::uint64_t{0}));
  app.add_flag("--dump", dump, "Print the effective configuration and end");
  app.add_flag("--parameters", show_parameters,
               "Print the page of the parameters under `node` and end");
  app.add_option("--latency", options.latency_file,
                 "File for the time that each frame took from its last image to its map delta");
  std::string metrics;
  std::filesystem::path health_socket;
  app.add_option("--metrics", metrics,
                 "[ADDRESS:]PORT where Prometheus finds /metrics; without an address of this "
                 "machine only; default: nowhere")
      ->envname("POCD_METRICS");
  app.add_option("--health-socket", health_socket,
                 "Socket for pocd_health --socket, which then needs no participant; default: none")
      ->envname("POCD_HEALTH_SOCKET");
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.bus.profiles_file, options.bus.security_folder);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (show_parameters) {
    std::cout << kParametersIntroduction << pocd::parameters_markdown<NodeGroup>();
    return std::cout.flush() ? 0 : 1;
  }
  try {
    pocd::load_config(options.config, files, overrides);
    options.config.node.set_robots(robots);
    if (dump) {
      std::cout << pocd::dump_config(options.config);
      return std::cout.flush() ? 0 : 1;
    }
    if (options.config.node.discovers()) {
      for (const std::string& pattern : options.config.node.topics.of_each_robot()) {
        if (pattern.find("{robot}") != std::string::npos) continue;
        throw pocd::InputError("no robot: node.topics has \"" + pattern +
                               "\", without {robot} to tell robots apart; give --robot NAME or "
                               "node.robots");
      }
    }
    options.bus.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_node: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_node", [&] {
    pocd::dds::log_to_stderr("pocd_node");
    pocd::dds::stop_on_signals();
    options.epoch = epoch ? *epoch : random_epoch();
    pocd::dds::ServiceNotice service;
    const auto endpoint = metrics_at(metrics, options);
    const auto socket = socket_at(health_socket);
    pocd::dds::HeapReturn heap;
    options.on_status = [&](const pocd::dds::NodeReport& report,
                            const pocd_msgs::msg::NodeHealth& health) {
      heap.turn();
      service.tell(report);
      if (endpoint) endpoint->update(report);
      if (socket) {
        socket->update({health.name(), pocd::dds::health_line(health), health.level() < 2,
                        health.ready(), 0.0});
      }
    };
    pocd::dds::Node node(options);
    spdlog::info("running on domain {}, epoch {:016x}, {} robot(s) named{}", options.bus.domain,
                 options.epoch, options.config.node.robots.size(),
                 options.config.node.discovers() ? ", others as they appear" : "");
    const bool good = node.run(pocd::dds::stop_requested);
    const pocd::dds::WorkStatus work = node.work_status();
    spdlog::info("ended: {} frames processed, {} refused, {} objects, map version {}",
                 work.processed, work.refused, work.objects, work.map.version);
    const double frames = static_cast<double>(std::max<std::uint64_t>(1, work.processed));
    spdlog::info(
        "CPU per frame [ms]: pipeline {:.2f}, publishing {:.2f}, taking images {:.2f}, the rest of "
        "the intake {:.2f}, the middleware's threads and others {:.2f}",
        work.pipeline_cpu_ms / frames, work.publishing_cpu_ms / frames, work.take_cpu_ms / frames,
        (work.intake_cpu_ms - work.take_cpu_ms) / frames,
        (work.process_cpu_ms - work.pipeline_cpu_ms - work.publishing_cpu_ms - work.intake_cpu_ms) /
            frames);
    if (work.kept) {
      spdlog::info(
          "memory: {} steps, {:.2f} MB written, a file of {:.2f} MB; CPU per step [ms]: copying "
          "{:.2f}, writing {:.2f}",
          work.kept->steps, 1e-6 * static_cast<double>(work.kept->written_bytes),
          1e-6 * static_cast<double>(work.kept->file_bytes),
          work.kept->gather_cpu_ms /
              static_cast<double>(std::max<std::uint64_t>(1, work.kept->steps)),
          work.kept->write_cpu_ms /
              static_cast<double>(std::max<std::uint64_t>(1, work.kept->steps)));
    }
    return good ? 0 : 1;
  });
}
