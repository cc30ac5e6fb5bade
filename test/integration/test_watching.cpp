// What a node says to those who watch it from outside of the bus.
#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "robot_sender.hpp"

namespace pocd {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;

/// What /metrics says; empty when nobody answers.
std::string scrape(int port) {
  asio::io_context context;
  tcp::socket socket(context);
  boost::system::error_code error;
  socket.connect({asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(port)}, error);
  if (error) return "";
  http::request<http::empty_body> request(http::verb::get, "/metrics", 11);
  request.set(http::field::host, "localhost");
  http::write(socket, request);
  boost::beast::flat_buffer buffer;
  http::response<http::string_body> response;
  http::read(socket, buffer, response);
  return response.result() == http::status::ok ? response.body() : "";
}

/// By name and labels, as Prometheus' text format has them: `a{b="c"} 1`.
std::map<std::string, double> samples(const std::string& text) {
  std::map<std::string, double> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t space = line.rfind(' ');
    if (line.empty() || line[0] == '#' || space == std::string::npos) continue;
    values[line.substr(0, space)] = std::stod(line.substr(space + 1));
  }
  return values;
}

std::set<std::string> names_in(const std::string& text) {
  const std::regex name("\\b(pocd|process)_[a-z0-9_]+");
  std::set<std::string> names;
  for (std::sregex_iterator at(text.begin(), text.end(), name), end; at != end; ++at) {
    names.insert(at->str());
  }
  return names;
}

int metrics_port(const Process& node) {
  const std::regex said("metrics on port ([0-9]+)");
  std::smatch port;
  const std::string text = node.err();
  return std::regex_search(text, port, said) ? std::stoi(port[1]) : 0;
}

/// Addresses in hexadecimal, as in /proc/net/tcp, that a process listens on.
std::set<std::string> listens_on(pid_t process) {
  std::set<std::string> sockets, addresses;
  const auto folder = "/proc/" + std::to_string(process) + "/fd";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::error_code gone;
    const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
    if (target.rfind("socket:[", 0) == 0) sockets.insert(target.substr(8, target.size() - 9));
  }
  for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream lines(table);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::vector<std::string> word{std::istream_iterator<std::string>(words), {}};
      if (word.size() < 10 || word[3] != "0A") continue;  // LISTEN
      if (sockets.count(word[9]) > 0) addresses.insert(word[1].substr(0, word[1].find(':')));
    }
  }
  return addresses;
}

TEST(Watching, PrometheusFindsWhatDiagnosticsHave) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender robot(bus, "robot1");
  // With everything that has numbers of its own.
  Process node(fleet_command(
      domain, {"--metrics", "0", "--name", "site_a", "--set", "node.segmentation=absent", "--set",
               "node.memory.folder=" + (folder.path() / "memory").string(), "--set",
               "map.memory.folder=" + folder.path().string(), "--set", "map.memory.limit=budget"}));
  ASSERT_TRUE(eventually([&] { return health.newest() && robot.matched(); })) << node.err();
  const int port = metrics_port(node);
  ASSERT_GT(port, 0) << node.err();
  EXPECT_EQ(listens_on(node.pid()), std::set<std::string>{"0100007F"}) << "this machine only";

  StampNs stamp_ns = 0;
  std::map<std::string, double> found;
  const auto of_node = [&](const std::string& name) { return found[name + "{node=\"site_a\"}"]; };
  EXPECT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 33'000'000);
    robot.send_image(stamp_ns - 20'000'000);  // an older one: a problem
    found = samples(scrape(port));
    return of_node("pocd_frames_processed_total") >= 3 && of_node("pocd_map_version") >= 1 &&
           found.count("pocd_problems_total{node=\"site_a\",topic=\"" + robot.depth_topic() +
                       "\",reason=\"stamp_backwards\"}") > 0;
  })) << scrape(port);
  EXPECT_GT(of_node("pocd_frames_received_total"), 0.0);  // counted a little before
  EXPECT_EQ(of_node("pocd_ready"), 1.0);
  EXPECT_EQ(of_node("pocd_robots"), 1.0);
  EXPECT_EQ((found["pocd_robot_present{node=\"site_a\",robot=\"robot1\"}"]), 1.0);
  EXPECT_GE((found["pocd_robot_frames_total{node=\"site_a\",robot=\"robot1\"}"]), 3.0);
  EXPECT_GT(of_node("pocd_process_cpu_seconds_total"), 0.0);
  EXPECT_LT(of_node("pocd_processing_seconds"), 1.0) << "seconds, not milliseconds";
  EXPECT_GT(of_node("process_resident_memory_bytes"), 1e6);
  EXPECT_GT(of_node("process_threads"), 3.0);

  // Dashboard and alerts ask for nothing that is not there.
  const std::set<std::string> there = names_in(scrape(port));
  for (const char* file : {"grafana.json", "alerts.yaml"}) {
    std::string text = read_text(source(std::string("launch_scripts/watching/") + file));
    text = std::regex_replace(text, std::regex("pocd_health"), "");  // the command
    const std::set<std::string> asked = names_in(text);
    EXPECT_GE(asked.size(), 10u) << file;
    for (const std::string& name : asked) EXPECT_EQ(there.count(name), 1u) << file << ": " << name;
  }
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

TEST(Watching, ASecondEndpointOnAPortIsRefusedAndWithoutOneNothingListens) {
  const TestDomain domain;
  HealthWatch health(test_participant(domain));
  Process quiet(fleet_command(domain));
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr; }));
  EXPECT_TRUE(listens_on(quiet.pid()).empty());
  const TestDomain another;
  Process first(fleet_command(another, {"--metrics", "127.0.0.1:0"}));
  ASSERT_TRUE(eventually([&] { return metrics_port(first) > 0; })) << first.err();
  const std::string port = std::to_string(metrics_port(first));
  const CommandResult second = run_command(fleet_command(another, {"--metrics", port}));
  EXPECT_NE(second.exit_code, 0);
  EXPECT_NE(second.err.find("--metrics " + port + ": cannot be listened on"), std::string::npos)
      << second.err;
  const CommandResult wrong = run_command(fleet_command(another, {"--metrics", "nowhere:x"}));
  EXPECT_NE(wrong.exit_code, 0);
  EXPECT_NE(wrong.err.find("--metrics nowhere:x"), std::string::npos) << wrong.err;
}

// Every health check of a container was a participant that came and went.
TEST(Watching, HealthIsAskedBySocketWithoutTheBus) {
  const TestDomain domain, nobody;
  const TemporaryFolder folder;
  const std::string socket = (folder.path() / "health").string();
  auto node = std::make_unique<Process>(fleet_command(domain, {"--health-socket", socket}));
  const auto ask = [&](const TestDomain& where, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{bin("pocd_health"), "--socket", socket, "--domain",
                                     where.text()};
    command.insert(command.end(), more.begin(), more.end());
    return run_command(command);
  };
  // On a domain where nobody could be heard.
  CommandResult said;
  EXPECT_TRUE(eventually([&] {
    said = ask(nobody, {"--timeout", "1"});
    return said.exit_code == 0;
  })) << said.out
      << node->err();
  EXPECT_EQ(said.out.rfind("pocd_node is up: running", 0), 0u) << said.out;
  EXPECT_EQ(ask(nobody, {"--ready", "--timeout", "20"}).exit_code, 0);
  // Another node's socket is not asked about this one.
  said = ask(nobody, {"--name", "another", "--timeout", "1"});
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_NE(said.out.find("another was not heard on domain"), std::string::npos) << said.out;

  // A second node on the path says so and goes on; it is asked on the bus.
  const TestDomain elsewhere;
  Process second(fleet_command(elsewhere, {"--health-socket", socket, "--name", "second"}));
  EXPECT_EQ(ask(elsewhere, {"--name", "second", "--timeout", "60"}).exit_code, 0) << second.err();
  EXPECT_NE(second.err().find("another process answers on this socket"), std::string::npos)
      << second.err();

  node->signal(SIGKILL);
  node->wait();
  EXPECT_TRUE(std::filesystem::exists(socket)) << "it was killed";
  EXPECT_EQ(ask(domain, {"--timeout", "2"}).exit_code, 1);
  node = std::make_unique<Process>(fleet_command(domain, {"--health-socket", socket}));
  EXPECT_TRUE(eventually([&] { return ask(nobody, {"--timeout", "1"}).exit_code == 0; }));
  node->signal(SIGTERM);
  EXPECT_EQ(node->wait().exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(socket));
}

// The run's own thread may hang, too: then the last word grows old.
TEST(Watching, ANodeThatIsStoppedIsNotUp) {
  const TestDomain domain, nobody;
  const TemporaryFolder folder;
  const std::string socket = (folder.path() / "health").string();
  Process node(fleet_command(domain, {"--health-socket", socket}));
  const auto ask = [&](const char* timeout_s) {
    return run_command({bin("pocd_health"), "--socket", socket, "--domain", nobody.text(),
                        "--timeout", timeout_s});
  };
  ASSERT_TRUE(eventually([&] { return ask("1").exit_code == 0; })) << node.err();
  node.signal(SIGSTOP);
  EXPECT_EQ(ask("1").exit_code, 1);
  node.signal(SIGCONT);
  EXPECT_TRUE(eventually([&] { return ask("1").exit_code == 0; }));
}

}  // namespace
}  // namespace pocd
