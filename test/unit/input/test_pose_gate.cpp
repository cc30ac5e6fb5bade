#include "pocd/input/pose_gate.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pocd/config/config_io.hpp"
#include "pocd/config/node_config.hpp"

namespace pocd {
namespace {

constexpr StampNs kPeriod_ns = 66'666'667;

class PoseGateTest : public ::testing::Test {
 protected:
  std::optional<std::string> show(int i, double x_m, double yaw_deg = 0.0,
                                  const std::string& robot = "r1") {
    Frame frame;
    frame.robot = robot;
    frame.stamp_ns = 1'000'000'000 + i * kPeriod_ns;
    frame.T_W_C.translation().x() = x_m;
    frame.T_W_C.linear() =
        Eigen::AngleAxisd(yaw_deg * M_PI / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return gate_.refuse(frame);
  }

  PoseGateConfig config_;
  PoseGate gate_{config_};
};

TEST_F(PoseGateTest, FirstPoseAndASteadyDrivePass) {
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(show(i, 5.0 + 0.1 * i, 2.0 * i)) << i;
}

TEST_F(PoseGateTest, SpikeIsRefusedAndTheDriveGoesOn) {
  for (int i = 0; i < 10; ++i) ASSERT_FALSE(show(i, 0.05 * i));
  const auto reason = show(10, 0.5 + 0.6);
  ASSERT_TRUE(reason);
  EXPECT_NE(reason->find("r1: pose jump of 0.65 m"), std::string::npos) << *reason;
  EXPECT_NE(reason->find("in 0.07 s"), std::string::npos) << *reason;
  EXPECT_FALSE(show(11, 0.55));
}

TEST_F(PoseGateTest, JumpsAtTheLimit) {
  ASSERT_FALSE(show(0, 0.0));
  // 0.10 m of slack and 3 m/s over a fifteenth of a second: 0.30 m.
  EXPECT_TRUE(show(1, 0.31));
  EXPECT_FALSE(show(1, 0.29));
}

TEST_F(PoseGateTest, TurnsAreJudgedToo) {
  ASSERT_FALSE(show(0, 0.0, 0.0));
  // 5 degrees of slack and 180 degrees/s over a fifteenth of a second: 17 degrees.
  EXPECT_TRUE(show(1, 0.0, 17.5));
  EXPECT_FALSE(show(1, 0.0, 16.5));
}

TEST_F(PoseGateTest, AGapInTimeAllowsMore) {
  ASSERT_FALSE(show(0, 0.0));
  EXPECT_FALSE(show(30, 5.0)) << "two seconds later";
}

TEST_F(PoseGateTest, LastingJumpIsAcceptedAfterEnoughFrames) {
  ASSERT_FALSE(show(0, 0.0));
  int refused = 0;
  int i = 1;
  // Before speed alone would explain it: 20 m at 3 m/s take 100 frames.
  for (; i < 60 && show(i, 20.0 + 0.05 * i); ++i) ++refused;
  EXPECT_EQ(refused, config_.accept_after_frames);
  for (int n = 1; n < 10; ++n) EXPECT_FALSE(show(i + n, 20.0 + 0.05 * (i + n)));
  EXPECT_TRUE(show(i + 10, 0.0)) << "the old place would be a jump now";
}

TEST_F(PoseGateTest, JumpsThatDisagreeAreNeverAccepted) {
  ASSERT_FALSE(show(0, 0.0));
  for (int i = 1; i < 60; ++i) EXPECT_TRUE(show(i, i % 2 ? 20.0 : -20.0)) << i;
}

TEST_F(PoseGateTest, GoodPosesBetweenJumpsRestartTheCount) {
  ASSERT_FALSE(show(0, 0.0));
  for (int i = 1; i < 200; ++i)
    EXPECT_EQ(show(i, i % 10 ? 40.0 : 0.0).has_value(), i % 10 != 0) << i;
}

TEST_F(PoseGateTest, JumpTooShortForTheSpeedIsOffTheWay) {
  // 0.3 m aside for six frames, whatever the direction: each is refused, and the way goes on.
  for (const double jump_m : {0.3, -0.3}) {
    PoseGate gate(config_);
    for (int i = 0; i < 40; ++i) {
      Frame frame;
      frame.stamp_ns = 1'000'000'000 + i * kPeriod_ns;
      const bool jumps = i >= 20 && i < 26;
      frame.T_W_C.translation().x() = 0.05 * i + (jumps ? jump_m : 0.0);
      EXPECT_EQ(gate.refuse(frame).has_value(), jumps) << i << " by " << jump_m;
    }
  }
}

TEST_F(PoseGateTest, StartsStopsAndTurnsAreOnTheWay) {
  // From rest to 1.5 m/s and back within 0.3 s each (5 m/s2), with a centimetre of noise.
  double x_m = 0.0, speed = 0.0;
  for (int i = 0; i < 90; ++i) {
    speed = std::clamp(speed + (i < 30 ? 0.0 : i < 60 ? 1.0 : -1.0) * 5.0 / 15.0, 0.0, 1.5);
    x_m += speed / 15.0;
    EXPECT_FALSE(show(i, x_m + (i % 2 ? 0.01 : -0.01))) << i;
  }
}

TEST_F(PoseGateTest, RobotsAreJudgedApart) {
  ASSERT_FALSE(show(0, 0.0));
  EXPECT_FALSE(show(1, 50.0, 90.0, "r2")) << "another robot's first pose";
  EXPECT_FALSE(show(2, 0.1));
  EXPECT_FALSE(show(3, 50.1, 90.0, "r2"));
  EXPECT_TRUE(show(4, 50.2));
}

TEST_F(PoseGateTest, NamelessRobotHasNoPrefix) {
  ASSERT_FALSE(show(0, 0.0, 0.0, ""));
  EXPECT_EQ(show(1, 2.0, 0.0, "")->find("pose jump"), 0u);
}

TEST_F(PoseGateTest, RobotsThatWereHeardOfLastAreKept) {
  const int names = static_cast<int>(PoseGate::kMostRobots) + 20;
  for (int i = 0; i < names; ++i) show(i, 0.0, 0.0, "name" + std::to_string(i));
  EXPECT_EQ(gate_.robots(), PoseGate::kMostRobots);
  EXPECT_FALSE(show(names, 50.0, 0.0, "name0")) << "forgotten, and so as new";
  EXPECT_TRUE(show(names + 1, 500.0, 0.0, "name" + std::to_string(names - 1)));
}

// They look opposite ways, half a metre apart, a few milliseconds after each other.
TEST_F(PoseGateTest, FrontAndBackCameraOfOneRobotDoNotTripEachOther) {
  NodeFile file;
  const std::string folder = std::string(POCD_SOURCE_DIR) + "/config/";
  load_config(file, {folder + "torwic.yaml", folder + "cameras/two_cameras.yaml"});
  const auto& robots = file.node.robots;
  ASSERT_EQ(robots.size(), 2u);
  EXPECT_NE(robots[0].name, robots[1].name);
  for (int i = 0; i < 60; ++i) {
    EXPECT_FALSE(show(i, 0.05 * i, 3.0 * i, robots[0].name)) << i;
    EXPECT_FALSE(show(i, 0.05 * i - 0.5, 3.0 * i + 180.0, robots[1].name)) << i;
  }
  EXPECT_TRUE(show(60, 3.0 - 0.5, 180.0, robots[0].name)) << "one would be off by a turn";
}

}  // namespace
}  // namespace pocd
