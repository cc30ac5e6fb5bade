// Objects and map over a network that loses packets, between two hosts that the test makes itself.
#include <gtest/gtest.h>

#include "lossy_link.hpp"
#include "map_source.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "robot_sender.hpp"

namespace pocd {
namespace {

struct Case {
  double loss;
  bool profile;  ///< with the profile for such networks
};

class LossyNetwork : public ::testing::TestWithParam<Case> {};

// Sixty steps of a map of about a megabyte, a hundred objects of which thirty go again. The mirror
// on the other host ends with the publisher's digest and the seventy objects.
TEST_P(LossyNetwork, ObjectsAndMapConverge) {
  const LossyLink link(GetParam().loss);
  if (!link.problem().empty()) GTEST_SKIP() << link.problem();
  const std::string profile =
      GetParam().profile ? source("launch_scripts/lossy_network.xml") : std::string();
  const TestDomain domain;
  MapSource map(domain, 7, 10.0, profile);
  dds::Writer<pocd_msgs::msg::ObjectStatePubSubType> objects(map.participant,
                                                             dds::topics::kObjects);
  std::vector<std::string> command{bin("pocd_mirror"), "--until-end", "--timeout", "110",
                                   "--domain",         domain.text()};
  if (GetParam().profile) command.insert(command.end(), {"--profiles", profile});
  const auto joined = std::chrono::steady_clock::now();
  Process mirror(link.over_there(command));
  ASSERT_TRUE(eventually([&] { return objects.matched() > 0; }));
  const auto matched = std::chrono::steady_clock::now();
  const auto object = [](int i) {
    pocd_msgs::msg::ObjectState state;
    state.uuid(dds::object_uuid(7, static_cast<ObjectId>(i)));
    state.epoch(7);
    state.local_id(static_cast<std::uint32_t>(i));
    return state;
  };
  for (int i = 1; i <= 100; ++i) {
    auto state = object(i);
    ASSERT_TRUE(objects.write(state));
    map.turn();
    if (i <= 60) map.step(6, true);
    if (i % 10 == 0) map.publication.send_manifest(70, false);
  }
  for (int i = 1; i <= 30; ++i) {
    auto state = object(i);
    ASSERT_TRUE(objects.dispose(state));
  }
  ASSERT_TRUE(objects.wait_acknowledged(kGenerous));
  while (map.publication.waiting() > 0) {
    map.wakeup.wait_for(std::chrono::milliseconds(5));
    map.turn();
  }
  map.publication.send_manifest(70, true);
  const auto written = std::chrono::steady_clock::now();
  std::atomic<bool> ended{false};
  CommandResult result;
  std::thread waiter([&] { result = mirror.wait(), ended = true; });
  while (!ended) {
    map.wakeup.wait_for(std::chrono::milliseconds(20));
    map.turn();
  }
  waiter.join();
  const auto seconds = [](auto from, auto to) {
    return std::chrono::duration<double>(to - from).count();
  };
  std::printf(
      "loss %.1f %%, %s: found after %.1f s, all there %.1f s after the last step, "
      "%llu packets lost\n",
      100 * GetParam().loss, GetParam().profile ? "lossy_network.xml" : "defaults",
      seconds(joined, matched), seconds(written, std::chrono::steady_clock::now()),
      static_cast<unsigned long long>(link.lost_there()));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("digest " + map.publication.publisher().digest().hex()),
            std::string::npos)
      << result.out;
  EXPECT_NE(result.out.find(" 70 objects"), std::string::npos) << result.out;
  EXPECT_GT(link.lost_there(), 0u) << "nothing was tested";
}

// Images are best effort: what the network loses does not come again.
TEST(LossyNetworkImages, WhatIsLostIsNamedAndRaisesTheLevel) {
  const LossyLink link(0.1);
  if (!link.problem().empty()) GTEST_SKIP() << link.problem();
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender robot(bus, "robot1");
  Process node(link.over_there(node_command(domain, {"--set", "node.segmentation=absent"})));
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr && robot.matched(); }))
      << node.err();
  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 33'000'000);
    return health.problem(robot.depth_topic(), "images_lost") > 0 && health.newest()->level() == 1;
  })) << node.err();
  EXPECT_NE(node.err().find("images_lost"), std::string::npos) << node.err();
}

INSTANTIATE_TEST_SUITE_P(Rates, LossyNetwork,
                         ::testing::Values(Case{0.005, true}, Case{0.02, true}, Case{0.005, false},
                                           Case{0.02, false}));

}  // namespace
}  // namespace pocd
