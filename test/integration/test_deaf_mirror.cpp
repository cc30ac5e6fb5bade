// A copy that the bus has lost on one side only, as after an overload: what the publisher sends to
// it does not arrive, and the publisher is there.
#include <gtest/gtest.h>
#include <sched.h>

#include <cstdlib>

#include "bus_harness.hpp"
#include "pocd_dds/map_mirror.hpp"

namespace pocd {
namespace {

/// This process and all it starts from here on, over UDP only, which a firewall can cut. problem()
/// says what is missing to make it.
const std::string& host_of_its_own() {
  static const std::string problem = [] {
    setenv("FASTRTPS_DEFAULT_PROFILES_FILE", source("launch_scripts/udp_only.xml").c_str(), 1);
    if (unshare(CLONE_NEWNET) != 0) return std::string("no right to make a network namespace");
    const CommandResult made = run_command({"/bin/sh", "-c",
                                            "PATH=$PATH:/usr/sbin:/sbin; ip link set lo up && "
                                            "iptables -t raw -nL PREROUTING"});
    return made.exit_code == 0 ? "" : "no namespace with a firewall: " + made.err;
  }();
  return problem;
}

TEST(DeafMirror, SaysSoAndJoinsTheBusAnew) {
  if (!host_of_its_own().empty()) GTEST_SKIP() << host_of_its_own();
  const TestDomain domain;
  Process node(node_command(domain, {"--lossless", "--set", "node.commands=true"}));
  ASSERT_TRUE(eventually([&] { return count_of(node.err(), "running on domain") > 0; }));
  MirrorOptions options;
  options.domain = domain.number();
  MapMirror mirror(options);
  const auto in_step = [](const MirrorStatus& status) { return status.in_step; };
  ASSERT_TRUE(mirror.wait_until(in_step, kGenerous)) << mirror.status().stale_because;
  EXPECT_EQ(run_command(play_command(domain, {"--max-frames", "60"})).exit_code, 0);
  ASSERT_TRUE(
      mirror.wait_until([](const MirrorStatus& status) { return status.objects > 0; }, kGenerous));

  // Unicast ports of the second participant of a host (RTPS 2.2, 9.6.1.1): announcements, which go
  // to a group, still arrive.
  const int port = 7400 + 250 * domain.number() + 12;
  const CommandResult cut =
      run_command({"/bin/sh", "-c",
                   "PATH=$PATH:/usr/sbin:/sbin; iptables -t raw -I PREROUTING -p udp --dport " +
                       std::to_string(port) + ":" + std::to_string(port + 1) + " -j DROP"});
  ASSERT_EQ(cut.exit_code, 0) << cut.err;
  std::string said;
  EXPECT_TRUE(mirror.wait_until(
      [&](const MirrorStatus& status) {
        said = status.stale_because;
        return !status.in_step;
      },
      kGenerous));
  EXPECT_EQ(said, "nothing was heard of the publisher for 10 s");
  // What goes meanwhile is not told to it.
  const CommandResult reset =
      run_command({bin("pocd_command"), "reset", "--by", "mira", "--domain", domain.text()});
  EXPECT_EQ(reset.exit_code, 0) << reset.err;
  EXPECT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.in_step && status.objects == 0; }, kGenerous))
      << mirror.status().stale_because << ", " << mirror.status().objects << " objects";

  node.signal(SIGINT);
  EXPECT_TRUE(mirror.wait_until([](const MirrorStatus& status) { return status.final_version; },
                                kGenerous));
  EXPECT_EQ(node.wait().exit_code, 0);
}

}  // namespace
}  // namespace pocd
