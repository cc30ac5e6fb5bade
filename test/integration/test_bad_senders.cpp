// Senders that are on the bus and yet cannot be used: the node names each once, counts it, goes on.
#include <gtest/gtest.h>

#include "robot_sender.hpp"

namespace pocd {
namespace {

TEST(BadSenders, AreNamedOnceAndCounted) {
  const TestDomain domain;
  const auto bus = test_participant(domain), other_bus = test_participant(domain);
  HealthWatch health(bus);
  // Of a participant of their own, because one cannot have two types of a topic.
  dds::Writer<nav_msgs::msg::OdometryPubSubType> wrong_type(
      other_bus, dds::topics::kOdometry, "rt/robot1/depth/camera_info", kTestDelivery);
  dds::Writer<nav_msgs::msg::OdometryPubSubType> wrong_tf(other_bus, dds::topics::kOdometry,
                                                          "rt/tf", kTestDelivery);
  dds::Writer<sensor_msgs::msg::ImagePubSubType> best_effort(
      bus, dds::topics::kSegmentation, "rt/robot1/segmentation", dds::topics::best_effort(5));
  dds::Writer<tf2_msgs::msg::TFMessagePubSubType> best_effort_tf(bus, dds::topics::kTf, "rt/tf",
                                                                 dds::topics::best_effort(5));
  RobotSender robot(bus, "robot1");
  Process node(node_command(domain, {"--lossless"}));  // asks for reliable delivery
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr && robot.matched(); }));
  const std::string info = "rt/robot1/depth/camera_info";
  EXPECT_TRUE(eventually([&] { return health.problem(info, "wrong_type") == 1; }));
  EXPECT_TRUE(eventually([&] { return health.problem("rt/tf", "wrong_type") == 1; }));
  EXPECT_TRUE(eventually(
      [&] { return health.problem("rt/robot1/segmentation", "incompatible_qos") == 1; }));
  EXPECT_TRUE(eventually([&] { return health.problem("rt/tf", "incompatible_qos") == 1; }))
      << "without loss, tf may not be lost either";

  robot.send_frame(33'000'000);
  robot.send_frame(66'000'000);
  robot.zoom(1.25);
  robot.send_frame(99'000'000);
  robot.send_frame(132'000'000);
  EXPECT_TRUE(eventually([&] { return health.problem(info, "camera_changed") == 1; }));

  node.signal(SIGTERM);
  const CommandResult result = node.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("4 frames processed"), std::string::npos) << result.err;
  EXPECT_EQ(count_of(result.err, info + ": wrong_type: has type "
                                        "nav_msgs::msg::dds_::Odometry_, expected "
                                        "sensor_msgs::msg::dds_::CameraInfo_"),
            1u)
      << result.err;
  EXPECT_EQ(count_of(result.err, "rt/robot1/segmentation: a writer does not offer the reliability"),
            1u)
      << result.err;
  EXPECT_EQ(count_of(result.err, info + ": camera_changed: 30 x 20, fx 40, fy 40, cx 15, cy 10 "
                                        "became 30 x 20, fx 50, fy 50, cx 15, cy 10"),
            1u)
      << result.err;
}

// Names on the bus are the peers' choice: no number of them takes memory without end.
TEST(BadSenders, WhatPeersNameIsBounded) {
  const TestDomain domain;
  const auto bus = test_participant(domain), other_bus = test_participant(domain);
  HealthWatch health(bus);
  Process node(fleet_command(domain));
  const auto topic = [](int robot) { return "rt/robot" + std::to_string(robot) + "/depth/"; };
  using Depth = dds::Writer<sensor_msgs::msg::ImagePubSubType>;
  using Odometry = dds::Writer<nav_msgs::msg::OdometryPubSubType>;
  std::vector<std::unique_ptr<Depth>> robots;
  for (int i = 0; i <= 200; ++i) {
    robots.push_back(
        std::make_unique<Depth>(bus, dds::topics::kDepth, topic(i) + "image_raw", kTestDelivery));
  }
  EXPECT_TRUE(eventually([&] {
    return health.problem(topic(200) + "image_raw", "too_many_robots") == 1;
  })) << node.err();
  EXPECT_TRUE(eventually([&] { return health.newest()->robots().size() == 200; }));

  std::vector<std::unique_ptr<Odometry>> wrong_types;
  for (int i = 0; i <= 200; ++i) {
    wrong_types.push_back(std::make_unique<Odometry>(other_bus, dds::topics::kOdometry,
                                                     topic(i) + "camera_info", kTestDelivery));
  }
  // With the one before there are 202 pairs of topic and reason, of which 200 have a place.
  EXPECT_TRUE(eventually([&] { return health.problem("other topics", "more_problems") == 2; }))
      << node.err();
  EXPECT_EQ(health.newest()->problems().size(), 201u);
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

}  // namespace
}  // namespace pocd
