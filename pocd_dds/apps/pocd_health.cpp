// Says how the component is, in one line: for containers, services and people.
#include <cstdio>

#include "apps/common.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace {

using pocd_msgs::msg::NodeHealth;

/// What it waits for, of those robots that do not deliver: "robot1: waiting for odom since 12.3".
std::string waiting(const NodeHealth& health) {
  std::string text;
  for (const auto& robot : health.robots()) {
    if (robot.frames() > 0 && robot.waiting_for().empty()) continue;
    text += text.empty() ? "" : "; ";
    text += robot.name() + ": ";
    text += robot.waiting_for().empty() ? "waiting for its first frame" : robot.waiting_for();
  }
  return text;
}

void print(const NodeHealth& health) {
  const std::string waits_for = waiting(health);
  std::printf("%s %s: %s%s%llu frames processed, %llu dropped, %u objects, map version %llu\n",
              health.name().c_str(), health.level() < 2 ? "is up" : "fails",
              health.message().c_str(),
              waits_for.empty() ? ", " : (", " + waits_for + ", ").c_str(),
              static_cast<unsigned long long>(health.frames_processed()),
              static_cast<unsigned long long>(health.frames_dropped()), health.objects(),
              static_cast<unsigned long long>(health.map_version()));
}

struct Question {
  std::string name = "pocd_node";
  double timeout_s = 10.0;
  bool ready = false;  ///< it has to be ready, too
};

int check(const pocd::dds::BusOptions& bus, const Question& question) {
  using Clock = std::chrono::steady_clock;
  pocd::dds::Wakeup wakeup;
  pocd::dds::Reader<pocd_msgs::msg::NodeHealthPubSubType> reader(
      std::make_shared<pocd::dds::Participant>(bus), pocd::dds::topics::kHealth, wakeup);
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(question.timeout_s));
  while (!pocd::dds::stop_requested && Clock::now() < deadline) {
    wakeup.wait_for(std::chrono::milliseconds(100));
    NodeHealth health;
    pocd::dds::SampleMeta meta;
    while (reader.take(health, meta)) {
      if (!meta.valid || health.name() != question.name || health.message() == "stopped") continue;
      const bool good = health.level() < 2 && (health.ready() || !question.ready);
      // Who asks whether it is ready waits for it.
      if (!good && question.ready && Clock::now() < deadline) continue;
      print(health);
      return good ? 0 : 1;
    }
    if (reader.take_misread() > 0) {
      std::printf("%s: %s\n", reader.topic().c_str(), reader.misread_from().c_str());
      return 1;
    }
  }
  std::printf("%s was not %s on domain %d within %g s\n", question.name.c_str(),
              question.ready ? "ready" : "heard", bus.domain, question.timeout_s);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Says in one line how pocd_node is and what it waits for.\n"
      "Example: pocd_health --timeout 5\n"
      "Exit code: 0 it is up, even while it waits for cameras; 1 it is not heard or it fails, 2 "
      "usage.",
      "pocd_health");
  pocd::dds::BusOptions bus;
  bus.name = "pocd_health";
  Question question;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--name", question.name, "Name of the node")
      ->envname("POCD_NAME")
      ->capture_default_str();
  app.add_option("--timeout", question.timeout_s, "Seconds to wait for it")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  app.add_flag("--ready", question.ready,
               "Wait until it is ready, too: it takes frames and publishes");
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, bus.profiles_file, bus.security_folder);
  try {
    app.parse(argc, argv);
    bus.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_health: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_health", [&] {
    pocd::dds::log_to_stderr("pocd_health");
    pocd::dds::stop_on_signals();
    return check(bus, question);
  });
}
