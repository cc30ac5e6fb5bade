// Without multicast: participants know a server, and are told by it of the others.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdlib>

#include "robot_sender.hpp"

namespace pocd {
namespace {

/// A UDP port of the loopback interface that is free now.
int free_port() {
  const int probe = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(bind(probe, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(probe);
  return ntohs(address.sin_port);
}

// A client is told only of topics that it has itself: the node could not find robots by theirs.
TEST(DiscoveryServer, RobotsAreFoundByTheirTopics) {
  const std::string server = "/usr/bin/fast-discovery-server";
  if (!std::filesystem::exists(server)) GTEST_SKIP() << server << " is not installed";
  const std::string port = std::to_string(free_port());
  Process serving({server, "-i", "0", "-l", "127.0.0.1", "-p", port});
  ::setenv("ROS_DISCOVERY_SERVER", ("127.0.0.1:" + port).c_str(), 1);
  const TestDomain domain;
  {
    const auto bus = test_participant(domain);
    HealthWatch health(bus);
    FrameWatch frames(bus);
    RobotSender robot(bus, "robot1");
    Process node(fleet_command(domain, {"--set", "node.segmentation=absent"}));
    ASSERT_TRUE(eventually([&] { return health.newest() && robot.matched() && frames.matched(); }))
        << node.err() << serving.out() << serving.err();
    StampNs stamp_ns = 0;
    EXPECT_TRUE(eventually([&] {
      robot.send_frame(stamp_ns += 33'000'000);
      return frames.processed("robot1") > 2;
    })) << node.err();
    node.signal(SIGTERM);
    EXPECT_EQ(node.wait().exit_code, 0);
    ::unsetenv("ROS_DISCOVERY_SERVER");
    EXPECT_TRUE(serving.running());
  }
}

}  // namespace
}  // namespace pocd
