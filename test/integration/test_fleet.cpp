// Robots come and go while the node runs.
#include <gtest/gtest.h>

#include <set>

#include "diagnostic_msgsPubSubTypes.h"
#include "robot_sender.hpp"
#include "whole_run.hpp"

namespace pocd {
namespace {

constexpr StampNs kMs = 1'000'000;

std::vector<std::string> play_live(const TestDomain& domain) {
  return {bin("pocd_play"), "--dataset", "sim", "--input", scenario(), "--domain", domain.text()};
}

TEST(Fleet, ARobotAppearsDiesIsNamedAndForgottenAndComesBack) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  FrameWatch frames(bus);
  RobotSender other(bus, "other");
  Process node(fleet_command(domain, {"--set", "node.segmentation=absent"}));
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr && frames.matched(); }));
  const auto present = [&] {
    std::set<std::string> names;
    for (const auto& robot : health.newest()->robots()) names.insert(robot.name());
    return names;
  };
  const auto departures = [&] { return health.newest()->departures(); };
  ASSERT_TRUE(eventually([&] { return other.matched(); })) << "was there before the node";

  {
    Process robot(play_live(domain));
    ASSERT_TRUE(eventually([&] { return frames.processed("robot1") > 2; })) << node.err();
    EXPECT_TRUE(eventually([&] { return present() == std::set<std::string>{"other", "robot1"}; }));
    robot.signal(SIGKILL);
    robot.wait();
  }
  ASSERT_TRUE(eventually([&] { return departures().size() == 1; })) << node.err();
  EXPECT_EQ(departures()[0].name(), "robot1");
  EXPECT_EQ(departures()[0].reason(), "no sign of life for its lease of 5 s");
  EXPECT_TRUE(eventually([&] { return present() == std::set<std::string>{"other"}; }));

  // All within merge_wait_s: had the dead robot a place left, these would wait for it. The node's
  // readers are best effort: sent until enough are heard.
  int sent = 0;
  EXPECT_TRUE(eventually([&] {
    if (sent < 90) other.send_frame(1000'000 * kMs + ++sent * 10 * kMs);
    return frames.processed("other") >= 4;
  })) << node.err();

  const int before = frames.processed("robot1");
  auto again = play_live(domain);
  again.insert(again.end(), {"--max-frames", "20"});
  EXPECT_EQ(run_command(again).exit_code, 0);
  EXPECT_TRUE(eventually([&] { return frames.processed("robot1") > before; })) << node.err();
  ASSERT_TRUE(eventually([&] { return departures().size() == 2; })) << node.err();
  EXPECT_EQ(departures()[1].name(), "robot1");
  EXPECT_EQ(departures()[1].reason().find("lease"), std::string::npos) << "it ended in order";

  node.signal(SIGTERM);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(count_of(ended.err, "robot1: has gone: no sign of life"), 1u) << ended.err;
  EXPECT_EQ(count_of(ended.err, "robot1: has gone"), 2u) << ended.err;
  EXPECT_EQ(count_of(ended.err, "robot1: is on the bus"), 2u) << ended.err;
}

// The map of robots that were found is the map of robots that were named, and the offline one.
TEST(Fleet, DiscoveredRobotsLiveEqualOffline) {
  const TemporaryFolder folder;
  const std::string demo = source("config/sim/demo.yaml");
  const RunSummary expected = offline_run(demo, folder.path() / "offline", {"--max-frames", "40"});
  const TestDomain domain;
  Process node(fleet_command(domain, {"--lossless"}));
  const std::string said =
      play_and_compare(domain, node, play_command(domain, {"--max-frames", "40"}, demo), expected);
  EXPECT_NE(said.find("40 frames processed"), std::string::npos) << said;
}

// Fast DDS 2.9 does not hear the goodbye of a Cyclone publisher whose process goes on: its images
// end, and it is there. That is noticed by its silence.
TEST(Fleet, ARobotThatFallsSilentIsSaidToBe) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  dds::Wakeup wakeup;
  dds::Reader<diagnostic_msgs::msg::DiagnosticArrayPubSubType> diagnostics(
      bus, dds::topics::kDiagnostics, wakeup);
  RobotSender robot(bus, "robot1");
  Process node(fleet_command(
      domain, {"--set", "node.segmentation=absent", "--set", "node.silent_wait_s=1.5"}));
  const auto level_of_robot = [&]() -> int {
    diagnostic_msgs::msg::DiagnosticArray array;
    dds::SampleMeta meta;
    int level = -1;
    while (diagnostics.take(array, meta)) {
      for (const auto& status : array.status()) {
        if (status.name() == "pocd_node: robot1") level = status.level();
      }
    }
    return level;
  };
  StampNs stamp_ns = 0;
  ASSERT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 33 * kMs);
    return level_of_robot() == 0 && health.newest() != nullptr &&
           health.newest()->frames_processed() > 0;
  })) << node.err();
  EXPECT_TRUE(eventually([&] { return level_of_robot() == 1; })) << "silence is a warning";
  EXPECT_TRUE(eventually([&] {
    const auto* said = health.newest();
    return said != nullptr && said->robots().size() == 1 && said->robots()[0].present() &&
           said->robots()[0].waiting_for().find("has sent no depth image for") != std::string::npos;
  }));
  EXPECT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 33 * kMs);
    return level_of_robot() == 0;
  })) << "and it is over when images come again";
}

// What is asked for reliably comes again when the network loses it; who offers less is named.
TEST(Fleet, SmallInputsCanBeAskedForReliably) {
  for (const bool reliably : {false, true}) {
    const TestDomain domain;
    const auto bus = test_participant(domain);
    HealthWatch health(bus);
    dds::Writer<sensor_msgs::msg::ImagePubSubType> depth(
        bus, dds::topics::kDepth, "rt/robot1/depth/image_raw", dds::topics::best_effort(5));
    dds::Writer<sensor_msgs::msg::CameraInfoPubSubType> info(
        bus, dds::topics::kCameraInfo, "rt/robot1/depth/camera_info", dds::topics::best_effort(5));
    TransformSender tf(bus, dds::topics::kTf);  // reliable
    Process node(fleet_command(domain, {"--set", std::string("node.reliable_tf_and_info=") +
                                                     (reliably ? "true" : "false")}));
    ASSERT_TRUE(eventually([&] { return depth.matched() > 0 && tf.matched(); })) << node.err();
    EXPECT_TRUE(eventually([&] {
      const bool refused = health.problem("rt/robot1/depth/camera_info", "incompatible_qos") == 1;
      return reliably ? refused && info.matched() == 0 : info.matched() > 0;
    })) << reliably
        << node.err();
    EXPECT_EQ(health.problem("rt/robot1/depth/image_raw", "incompatible_qos"), 0u);
  }
}

// Nothing ever comes on a segmentation topic that is announced and required.
TEST(Fleet, ASilentStreamHoldsNobodyForEver) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  FrameWatch frames(bus);
  RobotSender good(bus, "good", true), mute(bus, "mute", true);
  Process node(fleet_command(domain, {"--lossless", "--set", "node.segmentation=required", "--set",
                                      "node.silent_wait_s=0.5"}));
  ASSERT_TRUE(eventually([&] {
    return health.newest() != nullptr && frames.matched() && good.matched() && mute.matched();
  }));
  constexpr int kFrames = 45;  // more than a robot's readers and synchroniser hold
  for (int i = 1; i <= kFrames; ++i) {
    const StampNs stamp_ns = i * 33 * kMs;
    good.send_frame(stamp_ns);
    mute.send_odometry({"map", mute.camera_frame(), stamp_ns, {}});
    mute.send_image(stamp_ns);
  }
  EXPECT_TRUE(eventually([&] { return frames.processed("good") == kFrames; }))
      << frames.processed("good") << " " << node.err();
  EXPECT_EQ(frames.processed("mute"), 0);
  EXPECT_TRUE(
      eventually([&] { return health.problem("rt/mute/segmentation", "silent_stream") == 1; }));
  EXPECT_TRUE(eventually([&] {
    for (const auto& robot : health.newest()->robots()) {
      if (robot.name() == "mute") return robot.dropped() == kFrames;
    }
    return false;
  }));
  const auto said_of_mute = [&] {
    for (const auto& robot : health.newest()->robots()) {
      if (robot.name() == "mute") return robot.waiting_for();
    }
    return std::string("not there");
  };
  // Its images have stopped, too, which may be said already.
  EXPECT_EQ(said_of_mute().find("going on without rt/mute/segmentation, which is silent"), 0u)
      << said_of_mute();
  // It speaks again, and is waited for again.
  mute.send_labels((kFrames + 1) * 33 * kMs);
  EXPECT_TRUE(eventually([&] {
    return health.newest() && said_of_mute().find("going on without") == std::string::npos;
  })) << said_of_mute();
  for (int i = kFrames + 1; i <= kFrames + 3; ++i) {
    good.send_frame(i * 33 * kMs);
    mute.send_odometry({"map", mute.camera_frame(), i * 33 * kMs, {}});
    if (i > kFrames + 1) mute.send_labels(i * 33 * kMs);
    mute.send_image(i * 33 * kMs);
  }
  EXPECT_TRUE(eventually([&] { return frames.processed("mute") == 3; })) << node.err();
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

// Neither odometry nor tf says where its camera is; that tf says so of others does not help it.
TEST(Fleet, ARobotWithoutPosesHoldsNobodyForEver) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender lost(bus, "lost");
  TransformSender tf(bus, dds::topics::kTf);
  Process node(fleet_command(domain, {"--lossless", "--set", "node.segmentation=absent", "--set",
                                      "node.silent_wait_s=0.5"}));
  ASSERT_TRUE(
      eventually([&] { return health.newest() != nullptr && lost.matched() && tf.matched(); }));
  constexpr int kImages = 32 + 8;  // in its synchroniser and its reader
  for (int i = 1; i <= kImages; ++i) lost.send_image(i * 33 * kMs);
  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    tf.send({{"map", "other_camera", stamp_ns += 20 * kMs, {}}});
    return health.problem("rt/lost/odom or rt/tf", "silent_stream") == 1;
  })) << node.err();
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

// Object identifiers begin with the epoch: no two runs share one.
TEST(Fleet, NodesAndRestartsHaveEpochsOfTheirOwn) {
  const TestDomain domain;
  std::set<std::string> epochs;
  for (int start = 0; start < 2; ++start) {
    Process first(fleet_command(domain)), second(fleet_command(domain));
    for (Process* node : {&first, &second}) {
      ASSERT_TRUE(eventually([&] { return node->err().find("epoch ") != std::string::npos; }));
      const std::string said = node->err();
      epochs.insert(said.substr(said.find("epoch ") + 6, 16));
    }
  }
  EXPECT_EQ(epochs.size(), 4u);
}

TEST(Fleet, AWrongTypeOnARobotsTopicIsSaid) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  dds::Writer<sensor_msgs::msg::CameraInfoPubSubType> wrong(
      bus, dds::topics::kCameraInfo, "rt/odd/depth/image_raw", kTestDelivery);
  Process node(fleet_command(domain));
  EXPECT_TRUE(eventually([&] {
    return health.newest() != nullptr &&
           health.problem("rt/odd/depth/image_raw", "wrong_type") == 1;
  }));
  EXPECT_TRUE(health.newest()->robots().empty());
  node.signal(SIGTERM);
  const CommandResult ended = node.wait();
  EXPECT_NE(ended.err.find("has type sensor_msgs::msg::dds_::CameraInfo_, expected "
                           "sensor_msgs::msg::dds_::Image_"),
            std::string::npos)
      << ended.err;
}

}  // namespace
}  // namespace pocd
