// What is wrong with this configuration, this machine, this bus.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "apps/common.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd_dds/doctor/bus_checks.hpp"
#include "pocd_dds/doctor/machine_checks.hpp"

namespace {

using namespace pocd::dds;  // NOLINT: this file is about nothing else
using pocd::NodeConfig;
using pocd::NodeFile;

struct DoctorOptions {
  BusOptions bus;
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides, robots;
  double listen_s = 5.0;
  bool verbose = false, suggest = false;
  std::string proc = "/proc", shared_memory = "/dev/shm";
};

void add(Findings& to, const Findings& more) { to.insert(to.end(), more.begin(), more.end()); }

/// Errors of a configuration come a line each.
void add_lines(Findings& findings, const pocd::InputError& error) {
  std::istringstream lines(error.what());
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    findings.push_back({Severity::kError, "configuration", line,
                        "docs/parameters.md and docs/node_parameters.md list what there is"});
  }
}

/// Loads what can be loaded; every error is a finding.
Findings check_configuration(const DoctorOptions& options, NodeFile& config) {
  Findings findings;
  try {
    pocd::load_config(config, options.files, options.overrides);
  } catch (const pocd::InputError& error) {
    add_lines(findings, error);
    config = NodeFile{};
  }
  try {
    config.node.set_robots(options.robots);
  } catch (const pocd::InputError& error) {
    add_lines(findings, error);
  }
  return findings;
}

/// Says on stderr what is heard, each thing once, when it is heard first.
class Progress {
 public:
  void look(const BusPicture& bus, const IntakeStatus& intake) {
    for (const BusEndpoint& endpoint : bus.all()) {
      if (endpoint.writer) say(endpoint.topic + ": is announced");
    }
    for (const RobotStatus& robot : intake.robots) {
      if (robot.images > 0) say(robot.name + ": first image");
      if (robot.frames > 0) say(robot.name + ": first whole frame");
    }
    for (const ProblemCounter::Entry& problem : intake.problems) {
      say(problem.topic + ": " + problem.reason);
    }
  }

 private:
  void say(const std::string& line) {
    if (said_.insert(line).second) std::cerr << "pocd_doctor: " << line << std::endl;
  }

  std::set<std::string> said_;
};

/// A configuration for what is on the bus, on stdout. False: no depth camera is there.
bool suggest(const DoctorOptions& options) {
  BusWatch watch;
  BusOptions bus = options.bus;
  bus.listener = &watch;
  const Participant observer(bus);
  BusPicture picture;
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<long>(1e3 * options.listen_s));
  while (!stop_requested && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    for (const BusEvent& event : watch.take()) picture.hear(event);
  }
  const std::vector<pocd::RobotConfig> robots = pocd::suggest_robots(picture.topics());
  for (const pocd::RobotConfig& robot : robots) {
    const auto tell = [&](const std::string& topic, const char* what) {
      if (topic.empty()) std::cout << "# " << robot.name << ": " << what << '\n';
    };
    tell(robot.camera_info_topic, "no camera info is announced: no image can be used without");
    tell(robot.segmentation_topic, "no masks are announced");
    tell(robot.odometry_topic, "no odometry is announced: poses have to come on tf");
  }
  std::cout << pocd::suggestion_yaml(robots);
  if (robots.empty()) {
    std::cerr << "pocd_doctor: no depth images are announced on domain " << options.bus.domain
              << "; " << pocd::suggestion_text(picture.topics()) << '\n';
  }
  return !robots.empty();
}

/// Listens as a node would, beside a participant that looks at who and what is there.
/// `multicast`: it works on some interface.
Findings check_bus(const DoctorOptions& options, NodeFile config, bool multicast) {
  Findings findings;
  BusWatch watch, intake_watch;
  BusOptions bus = options.bus;
  bus.listener = &watch;
  const Participant observer(bus);
  bus.listener = &intake_watch;
  const auto listener = std::make_shared<Participant>(bus);
  const NodeConfig expected = config.node;
  config.node.lossless = false;  // that would hold senders back
  FrameQueue frames(1);
  LatencyLog latency("");
  Intake intake(listener, config.node, config.pipeline, intake_watch, frames, latency);
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<long>(1e3 * options.listen_s));
  BusPicture picture;
  Progress progress;
  const auto look = [&] {
    for (const BusEvent& event : watch.take()) picture.hear(event);
    if (options.verbose) progress.look(picture, intake.status());
  };
  while (!stop_requested && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    look();
  }
  look();
  std::string names;
  for (const auto& [key, name] : picture.participants()) {
    if (name == bus.name) continue;
    // Cyclone DDS gives its participants no name.
    names += (names.empty() ? "" : ", ") + (name.empty() ? "one without a name" : name);
  }
  const std::string domain = "domain " + std::to_string(bus.domain);
  if (names.empty()) {
    findings.push_back(
        {Severity::kError, domain,
         multicast
             ? "nobody else is there"
             : "nobody else is there: asked by unicast on this host, as multicast does not work",
         "check --domain and ROS_DOMAIN_ID on both sides" +
             std::string(multicast ? ", and that multicast works between hosts" : "") +
             "; containers need one /dev/shm (--ipc host)"});
  } else if (!multicast) {
    findings.push_back({Severity::kError, domain,
                        "participants: " + names +
                            ", found by unicast: without multicast, those that ask nobody by "
                            "unicast do not find each other",
                        "see multicast above"});
  } else {
    findings.push_back({Severity::kNote, domain, "participants: " + names, ""});
  }
  add(findings, check_topics(picture, expected));
  add(findings, check_intake(intake.status()));
  return findings;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Says what is wrong with this configuration, this machine and this bus, one line each, and "
      "what to do.\n"
      "Example: pocd_doctor --config config/torwic.yaml --robot robot1 --domain 7\n"
      "Exit code: 0 nothing wrong (notes at most), 1 something is, 2 usage.",
      "pocd_doctor");
  DoctorOptions options;
  options.bus.name = "pocd_doctor";
  options.bus.ask_this_host = true;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--config", options.files, "Configuration file of the node; repeat it to overlay")
      ->allow_extra_args(false);
  app.add_option("--set", options.overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--robot", options.robots,
                 "A robot that should be there, as for pocd_node; repeat it")
      ->allow_extra_args(false);
  app.add_option("--listen", options.listen_s, "How long to listen to the bus [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  app.add_flag("--suggest", options.suggest,
               "Only print a configuration for the cameras that are on the bus (--config of "
               "pocd_node and pocd_map)");
  app.add_flag("--verbose", options.verbose, "Say on stderr what is heard as soon as it is heard");
  app.add_option("--proc", options.proc, "Where the machine's /proc is")->capture_default_str();
  app.add_option("--shm", options.shared_memory, "Where shared memory is")->capture_default_str();
  int domain = -1;
  add_bus_options(app, domain, options.bus.profiles_file, options.bus.security_folder);
  try {
    app.parse(argc, argv);
    options.bus.domain = domain >= 0 ? domain : default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_doctor: " << error.what() << '\n';
    return 2;
  }
  return guarded("pocd_doctor", [&] {
    log_to_stderr("pocd_doctor");
    spdlog::set_level(spdlog::level::off);  // everything is a finding
    stop_on_signals();
    if (options.suggest) return suggest(options) && std::cout.flush() ? 0 : 1;
    NodeFile config;
    Findings findings = check_configuration(options, config);
    add(findings, check_network_settings(options.proc));
    add(findings, check_shared_memory(options.shared_memory));
    add(findings, check_environment(std::filesystem::current_path()));
    const std::map<std::string, std::string> multicast = multicast_by_interface();
    add(findings, check_multicast(multicast));
    try {
      const bool works = std::any_of(multicast.begin(), multicast.end(),
                                     [](const auto& entry) { return entry.second.empty(); });
      add(findings, check_bus(options, config, works));
    } catch (const pocd::InputError& error) {
      findings.push_back({Severity::kError, "bus", error.what(), "see docs/topics_and_qos.md"});
    }
    std::stable_sort(findings.begin(), findings.end(),
                     [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
    bool good = true;
    for (const Finding& finding : findings) {
      std::cout << line_of(finding) << '\n';
      good = good && finding.severity == Severity::kNote;
    }
    if (good) std::cout << "nothing wrong was found\n";
    return std::cout.flush() && good ? 0 : 1;
  });
}
