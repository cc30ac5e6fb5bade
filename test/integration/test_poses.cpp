// The ways in which fleets say where a robot is, as real messages, and what is said about bad ones.
#include <gtest/gtest.h>

#include "pocd_dds/bridge/map_messages.hpp"
#include "robot_sender.hpp"

namespace pocd {
namespace {

constexpr StampNs kMs = 1'000'000;
constexpr int kImages = 8;

PoseQuaternion at(double x, double y) {
  PoseQuaternion pose;
  pose.position = {x, y, 0.0};
  return pose;
}

/// Looks along +x of the base, from a mast of 1 m.
StampedTransform mount(const std::string& camera) {
  StampedTransform T{"base", camera, 0, {}};
  T.T.position = {0.25, 0.0, 1.0};
  T.T.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  return T;
}

enum class Way { kOdometryInMap, kOdometryInOdom, kTfOnly };

struct Outcome {
  std::string digest;
  std::uint32_t tiles = 0;
};

/// What a node makes of a robot that drives along x at 1.25 m/s, with poses every 50 ms, and images
/// half way between. All numbers are sums of powers of two, so no way rounds differently.
Outcome drive(Way way, const std::vector<std::string>& more = {}, const std::string& tf = "rt/tf") {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  FrameWatch frames(bus);
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::MapManifestPubSubType> manifest(bus, dds::topics::kMapManifest,
                                                              wakeup);
  RobotSender robot(bus, "robot1");
  dds::TopicSpec moving = dds::topics::kTf, fixed = dds::topics::kTfStatic;
  const std::string tf_static = tf + "_static";
  moving.name = tf.c_str();
  fixed.name = tf_static.c_str();
  TransformSender transforms(bus, moving), statics(bus, fixed);
  statics.send({mount(robot.camera_frame())});  // long before anybody listens
  std::vector<std::string> command =
      fleet_command(domain, {"--lossless", "--epoch", "5", "--set", "node.segmentation=absent"});
  command.insert(command.end(), more.begin(), more.end());
  Process node(command);
  EXPECT_TRUE(eventually([&] {
    return frames.matched() && manifest.matched() > 0 && robot.matched() && transforms.matched() &&
           statics.matched();
  })) << node.err();

  for (int i = 0; i <= kImages; ++i) {
    const StampNs pose_ns = 1'000 * kMs + i * 50 * kMs;
    const double x = 0.0625 * i;
    switch (way) {
      case Way::kOdometryInMap:
        robot.send_odometry({"map", "base", pose_ns, at(8 + x, 4)});
        break;
      case Way::kOdometryInOdom:
        // The correction comes less often than the odometry.
        if (i % 2 == 0) transforms.send({{"map", "odom", pose_ns, at(8, 4)}});
        robot.send_odometry({"odom", "base", pose_ns, at(x, 0)});
        break;
      case Way::kTfOnly:
        transforms.send({{"map", "odom", pose_ns, at(8, 4)}, {"odom", "base", pose_ns, at(x, 0)}});
        break;
    }
    if (i < kImages) robot.send_image(pose_ns + 25 * kMs);
  }
  EXPECT_TRUE(eventually([&] { return frames.processed("robot1") == kImages; }))
      << frames.processed("robot1") << " " << node.err();
  node.signal(SIGTERM);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  Outcome outcome;
  EXPECT_TRUE(eventually([&] {
    pocd_msgs::msg::MapManifest message;
    dds::SampleMeta meta;
    while (manifest.take(message, meta)) {
      if (!meta.valid || !message.final_version()) continue;
      outcome = {dds::digest_from(message.digest()).hex(), message.tile_count()};
    }
    return !outcome.digest.empty();
  }));
  return outcome;
}

TEST(Poses, ThreeWaysToSayTheSameGiveTheSameMap) {
  const Outcome in_map = drive(Way::kOdometryInMap);
  EXPECT_GT(in_map.tiles, 0u);
  EXPECT_EQ(drive(Way::kOdometryInOdom).digest, in_map.digest);
  EXPECT_EQ(drive(Way::kTfOnly).digest, in_map.digest);
}

TEST(Poses, ARobotMayHaveTransformTopicsOfItsOwn) {
  const std::vector<std::string> own{"--set", "node.topics.tf=rt/{robot}/tf", "--set",
                                     "node.topics.tf_static=rt/{robot}/tf_static"};
  EXPECT_GT(drive(Way::kTfOnly, own, "rt/robot1/tf").tiles, 0u);
}

TEST(Poses, WrongFramesAreNamed) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender lost(bus, "lost"), round(bus, "round"), renamed(bus, "renamed"), moved(bus, "moved");
  TransformSender statics(bus, dds::topics::kTfStatic);
  statics.send({{"round_base", "round_camera", 0, {}}, {"round_camera", "round_base", 0, {}}});
  Process node(fleet_command(domain, {"--set", "node.segmentation=absent"}));
  ASSERT_TRUE(eventually([&] {
    return health.newest() != nullptr && lost.matched() && round.matched() && renamed.matched() &&
           moved.matched() && statics.matched();
  }));
  int i = 0;
  // Best effort on the node's side: sent until it is heard.
  const auto send = [&] {
    const StampNs stamp_ns = ++i * 200 * kMs;
    lost.send_image(stamp_ns);
    round.send_image(stamp_ns);
    renamed.send_image(stamp_ns, i % 2 == 0 ? "front" : "front_camera");
    moved.send_odometry({i % 2 == 0 ? "odom" : "map", "moved_camera", stamp_ns, {}});
    return health.newest() != nullptr;
  };
  EXPECT_TRUE(eventually([&] {
    return send() && health.problem(lost.depth_topic(), "no_transform") > 0 &&
           health.problem(round.depth_topic(), "transform_loop") > 0 &&
           health.problem(renamed.depth_topic(), "frame_changed") > 0 &&
           health.problem("rt/moved/odom", "parent_changed") > 0;
  })) << node.err();
  node.signal(SIGTERM);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0);
  for (const char* said :
       {"no transform leads from \"lost_camera\" to \"map\": nobody says where \"lost_camera\" is",
        "frames go round in a loop and never reach \"map\": round_camera <- round_base <- "
        "round_camera",
        "header.frame_id was \"front", "frame \"moved_camera\" had parent \""}) {
    const std::size_t first = ended.err.find(said);
    EXPECT_NE(first, std::string::npos) << said << "\n" << ended.err;
    EXPECT_EQ(ended.err.find(said, first + 1), std::string::npos) << "said once: " << said;
  }
}

}  // namespace
}  // namespace pocd
