// Says how the component is, in one line: for containers, services and people.
#include <cstdio>
#include <filesystem>
#include <optional>
#include <thread>

#include "apps/common.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/watch/health_line.hpp"
#include "pocd_dds/watch/health_socket.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace {

using pocd_msgs::msg::NodeHealth;

struct Question {
  std::string name = "pocd_node";
  double timeout_s = 10.0;
  bool ready = false;  ///< it has to be ready, too
  std::filesystem::path socket;
};

using Clock = std::chrono::steady_clock;

// A node says how it is once a second: what is older was said before it hung.
constexpr double kNewestS = 3.0;

int say(const std::string& line, bool good) {
  std::printf("%s\n", line.c_str());
  return good ? 0 : 1;
}

/// By the socket of a node of this machine. Without a value: there is none, or it is another
/// node's, and the bus may know.
std::optional<int> check_socket(const Question& question, Clock::time_point deadline) {
  using Seconds = std::chrono::duration<double>;
  while (!pocd::dds::stop_requested) {
    const double left_s = Seconds(deadline - Clock::now()).count();
    const auto word = pocd::dds::ask_health(question.socket, std::max(0.1, left_s));
    if (!word || word->name != question.name) return std::nullopt;
    const bool fresh = word->age_s < kNewestS;
    if (fresh && (word->ready || !question.ready)) return say(word->line, word->good);
    // Who asks whether it is ready waits for it.
    if (Clock::now() >= deadline) {
      if (fresh) return say(word->line, false);
      return say(fmt::format("{} hangs: it has said nothing for {:.0f} s", word->name, word->age_s),
                 false);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return 1;
}

int check_bus(const pocd::dds::BusOptions& bus, const Question& question,
              Clock::time_point deadline) {
  pocd::dds::Wakeup wakeup;
  pocd::dds::Reader<pocd_msgs::msg::NodeHealthPubSubType> reader(
      std::make_shared<pocd::dds::Participant>(bus), pocd::dds::topics::kHealth, wakeup);
  while (!pocd::dds::stop_requested && Clock::now() < deadline) {
    wakeup.wait_for(std::chrono::milliseconds(100));
    NodeHealth health;
    pocd::dds::SampleMeta meta;
    while (reader.take(health, meta)) {
      if (!meta.valid || health.name() != question.name || health.message() == "stopped") continue;
      const bool good = health.level() < 2 && (health.ready() || !question.ready);
      // Who asks whether it is ready waits for it.
      if (!good && question.ready && Clock::now() < deadline) continue;
      return say(pocd::dds::health_line(health), good);
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

int check(const pocd::dds::BusOptions& bus, const Question& question) {
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(question.timeout_s));
  if (!question.socket.empty()) {
    if (const std::optional<int> code = check_socket(question, deadline)) return *code;
  }
  return check_bus(bus, question, deadline);
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
  app.add_option("--socket", question.socket,
                 "Socket that the node was started with (--health-socket): asks there, and on the "
                 "bus only when nobody answers")
      ->envname("POCD_HEALTH_SOCKET");
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
