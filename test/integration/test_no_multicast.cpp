// A host without multicast: everything on the loopback interface of a network namespace that drops
// what is sent to groups.
#include <gtest/gtest.h>
#include <sched.h>

#include "bus_harness.hpp"

namespace pocd {
namespace {

/// This process and all it starts from here on. problem() says what is missing to make it.
const std::string& host_without_multicast() {
  static const std::string problem = [] {
    if (unshare(CLONE_NEWNET) != 0) return std::string("no right to make a network namespace");
    const CommandResult made =
        run_command({"/bin/sh", "-c",
                     "PATH=$PATH:/usr/sbin:/sbin; ip link set lo up && "
                     "iptables -t raw -I PREROUTING -d 224.0.0.0/4 -j DROP"});
    return made.exit_code == 0 ? "" : "no namespace without multicast: " + made.err;
  }();
  return problem;
}

class NoMulticast : public testing::Test {
 protected:
  void SetUp() override {
    if (!host_without_multicast().empty()) GTEST_SKIP() << host_without_multicast();
  }
};

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(NoMulticast, DoctorSaysSoAndFindsParticipantsByUnicast) {
  const TestDomain domain;
  Process node(node_command(domain));
  ASSERT_TRUE(eventually([&] { return says(node.err(), "running on domain"); })) << node.err();
  CommandResult result;
  EXPECT_TRUE(eventually([&] {
    result = run_command({bin("pocd_doctor"), "--domain", domain.text(), "--listen", "2"});
    return says(result.out, "participants: ");
  })) << result.out;
  EXPECT_EQ(result.exit_code, 1);
  for (const char* part : {"error: multicast on lo: what is sent to a group does not arrive",
                           "--profiles launch_scripts/no_multicast.xml",
                           "participants: pocd_node, found by unicast"}) {
    EXPECT_TRUE(says(result.out, part)) << part << '\n' << result.out;
  }
}

TEST_F(NoMulticast, DoctorSaysWhomItHasAskedWhereNobodyIs) {
  const TestDomain domain;
  const CommandResult result =
      run_command({bin("pocd_doctor"), "--domain", domain.text(), "--listen", "0.5"});
  EXPECT_TRUE(says(result.out, "nobody else is there: asked by unicast on this host"))
      << result.out;
}

// The player has no peers; the component asks.
TEST_F(NoMulticast, ComponentWithInitialPeersIsFound) {
  const TestDomain domain;
  Process node(node_command(
      domain, {"--lossless", "--profiles", source("launch_scripts/no_multicast.xml")}));
  const CommandResult played = run_command(play_command(domain, {"--max-frames", "20"}));
  EXPECT_EQ(played.exit_code, 0) << played.err;
  node.signal(SIGINT);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(says(ended.err, "20 frames processed")) << ended.err;
}

}  // namespace
}  // namespace pocd
