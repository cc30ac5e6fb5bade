// PoseBuffer, TransformTree, quaternion round trips and the merging of robots' frames.
#include <gtest/gtest.h>

#include <algorithm>

#include "pocd/common/random.hpp"
#include "pocd/input/frame_merger.hpp"
#include "pocd/input/pose_buffer.hpp"
#include "pocd/input/transform_tree.hpp"

namespace pocd {
namespace {

PoseQuaternion random_pose(Random& random) {
  PoseQuaternion pose;
  pose.position = {random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(-9, 9)};
  pose.rotation =
      Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
          .normalized();
  return pose;
}

TEST(PoseBuffer, GivesAStoredPoseBackBitByBit) {
  Random random(1);
  PoseBuffer buffer(1000, 100);
  std::vector<PoseQuaternion> poses;
  for (int i = 0; i < 50; ++i) {
    poses.push_back(random_pose(random));
    ASSERT_EQ(buffer.add(i * 100, poses.back()), StampOrder::Verdict::kAccepted);
  }
  for (int i = 0; i < 50; ++i) {
    PoseQuaternion pose;
    ASSERT_EQ(buffer.at(i * 100, 0, pose), PoseLookup::kFound);
    EXPECT_EQ(pose.position, poses[i].position);
    EXPECT_EQ(pose.rotation.coeffs(), poses[i].rotation.coeffs());
  }
}

TEST(PoseBuffer, InterpolatesATurnAtConstantSpeed) {
  PoseBuffer buffer(1000, 10);
  buffer.add(0, {});
  const double turn = 1.2;
  PoseQuaternion end;
  end.position = {0, 4, 0};
  end.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
  buffer.add(1000, end);
  PoseQuaternion pose;
  ASSERT_EQ(buffer.at(250, 0, pose), PoseLookup::kFound);
  EXPECT_NEAR(pose.position.y(), 1.0, 1e-12);  // one product and one sum of doubles
  EXPECT_NEAR(Eigen::AngleAxisd(pose.rotation).angle(), turn / 4, 1e-12);
}

TEST(PoseBuffer, SaysWhyThereIsNoPose) {
  PoseBuffer buffer(100, 3);
  PoseQuaternion pose;
  EXPECT_EQ(buffer.at(0, 0, pose), PoseLookup::kEmpty);
  for (StampNs stamp : {0, 100, 200, 301}) buffer.add(stamp, {});
  EXPECT_EQ(buffer.at(50, 0, pose), PoseLookup::kTooOld);  // capacity 3: stamp 0 is gone
  EXPECT_EQ(buffer.at(250, 0, pose), PoseLookup::kGap);    // 101 > 100
  EXPECT_EQ(buffer.at(302, 0, pose), PoseLookup::kTooNew);
  EXPECT_EQ(buffer.at(302, 1, pose), PoseLookup::kFound);
  EXPECT_EQ(buffer.at(303, 1, pose), PoseLookup::kTooNew);
  EXPECT_EQ(buffer.add(300, {}), StampOrder::Verdict::kRefused);
}

TEST(TransformTree, ChainsMapOdomBaseCamera) {
  Random random(2);
  const PoseQuaternion map_odom = random_pose(random), odom_base = random_pose(random),
                       base_camera = random_pose(random);
  TransformTree tree(1000);
  tree.set_static("base", "camera", base_camera);
  tree.add("odom", "base", 10, odom_base);
  TransformLookup found = tree.lookup("map", "camera", 10, 0);
  EXPECT_EQ(found.result, PoseLookup::kEmpty);
  EXPECT_EQ(found.edge, "? -> odom");
  tree.add("map", "odom", 0, map_odom);
  tree.add("map", "odom", 20, map_odom);
  found = tree.lookup("map", "camera", 10, 0);
  ASSERT_EQ(found.result, PoseLookup::kFound);
  const Pose expected = to_pose(map_odom) * to_pose(odom_base) * to_pose(base_camera);
  EXPECT_TRUE(found.T_target_source.isApprox(expected, 1e-12));
  EXPECT_EQ(tree.lookup("map", "camera", 21, 0).edge, "odom -> base");
}

TEST(TransformTree, ALoopIsNoChain) {
  TransformTree tree(1000);
  tree.set_static("a", "b", {});
  tree.set_static("b", "a", {});
  EXPECT_EQ(tree.lookup("map", "a", 0, 0).result, PoseLookup::kLoop);
}

// The pose that a node computes from messages is the one that an offline run computes, in every
// bit.
TEST(TransformTree, EqualsThroughMessagesBitByBit) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Pose T_W_C = to_pose(random_pose(random)), T_B_C = to_pose(random_pose(random));
    TransformTree tree(1000);
    tree.set_static("base", "camera", to_quaternion(T_B_C));
    tree.add("map", "base", 5, to_quaternion(T_W_C * T_B_C.inverse()));
    const TransformLookup found = tree.lookup("map", "camera", 5, 0);
    ASSERT_EQ(found.result, PoseLookup::kFound);
    EXPECT_EQ(found.T_target_source.matrix(), through_messages(T_W_C, T_B_C).matrix());
    // Ten roundings of numbers below 30.
    EXPECT_TRUE(found.T_target_source.isApprox(T_W_C, 1e-13));
  }
}

// Two robots' frames arrive in any interleaving; the order that comes out is always the same.
TEST(FrameMerger, OrderDoesNotDependOnArrival) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    FrameMerger<std::string> merger(std::nullopt);
    merger.set_live("a", true);
    merger.set_live("b", true);
    std::string order;
    int next[2] = {0, 0};
    while (next[0] < 10 || next[1] < 10) {
      const auto robot = random.below(2);
      if (next[robot] >= 10) continue;
      const std::string name = robot == 0 ? "a" : "b";
      const StampNs stamp_ns = next[robot]++ * 100;
      merger.add(name, stamp_ns, name + std::to_string(stamp_ns) + " ");
      merger.set_watermark(name, stamp_ns);
      while (auto item = merger.take()) order += *item;
    }
    while (auto item = merger.take(true)) order += *item;
    EXPECT_EQ(order,
              "a0 b0 a100 b100 a200 b200 a300 b300 a400 b400 a500 b500 a600 b600 a700 b700 a800 "
              "b800 a900 b900 ");
  }
}

TEST(FrameMerger, GoesOnWithoutARobotThatHasGoneOrLags) {
  FrameMerger<int> merger(1000);
  merger.set_live("a", true);
  merger.set_live("b", true);
  merger.add("a", 0, 1);
  merger.set_watermark("a", 0);
  EXPECT_FALSE(merger.take());
  EXPECT_EQ(merger.waits_for(), "b");
  merger.add("a", 1001, 2);
  merger.set_watermark("a", 1001);
  EXPECT_EQ(merger.take(), 1);  // b lags by more than the wait
  EXPECT_FALSE(merger.take());
  merger.set_live("b", false);
  EXPECT_EQ(merger.take(), 2);
}

// A dead robot is not waited for, leaves nothing behind, and may come back with any clock.
// A frame from far in the future that waits for the other robot must not hold up its own robot's
// next ones.
TEST(FrameMerger, ARobotWhoseStampsStartAnewIsNotHeldUp) {
  FrameMerger<int> merger(1000);
  merger.set_live("a", true);
  merger.set_live("b", true);
  const auto add = [&](const std::string& robot, StampNs stamp_ns, int item) {
    merger.add(robot, stamp_ns, item);
    merger.set_watermark(robot, stamp_ns);
  };
  add("a", 5'000'000, 1);
  add("a", 100, 2);
  add("b", 110, 3);
  add("a", 120, 4);
  for (const int item : {1, 2, 3}) EXPECT_EQ(merger.take(), item);
  EXPECT_EQ(merger.take(), std::nullopt) << "b may still send one before 120";
}

TEST(FrameMerger, ForgetsARobotAndItsClock) {
  FrameMerger<int> merger(1000);
  merger.set_live("a", true);
  merger.set_live("b", true);
  merger.add("a", 5000000, 1);
  merger.set_watermark("a", 5000000);
  EXPECT_FALSE(merger.take());
  merger.forget("b");
  EXPECT_FALSE(merger.knows("b"));
  merger.forget("a");
  EXPECT_TRUE(merger.knows("a")) << "a frame is left";
  EXPECT_EQ(merger.take(), 1);
  EXPECT_FALSE(merger.knows("a"));
  // Had the old clock stayed, b would count as far behind from now on.
  merger.set_live("a", true);
  merger.set_live("b", true);
  merger.add("a", 10, 2);
  merger.set_watermark("a", 10);
  EXPECT_FALSE(merger.take());
  EXPECT_EQ(merger.waits_for(), "b");
  merger.add("b", 5, 3);
  merger.set_watermark("b", 5);
  EXPECT_EQ(merger.take(), 3);
}

}  // namespace
}  // namespace pocd
