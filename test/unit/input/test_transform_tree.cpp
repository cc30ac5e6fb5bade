// The ways in which fleets say where a robot is, and what is said when they say it wrong.
#include <gtest/gtest.h>

#include "pocd/input/time_synchronizer.hpp"
#include "pocd/input/transform_tree.hpp"

namespace pocd {
namespace {

PoseQuaternion shifted(double x, double y = 0.0) {
  PoseQuaternion pose;
  pose.position = {x, y, 0.0};
  return pose;
}

double x_of(const TransformLookup& found) { return found.T_target_source.translation().x(); }

// 0 to 1 m in 100 ns along x, seen at 50 ns, with the camera 0.25 m ahead.
TEST(TransformTree, ThreeWaysToSayTheSame) {
  TransformTree in_map(1000);
  in_map.add("map", "base", 0, shifted(8));
  in_map.add("map", "base", 100, shifted(9));
  TransformTree in_odom(1000);
  in_odom.add("odom", "base", 0, shifted(0));
  in_odom.add("odom", "base", 100, shifted(1));
  in_odom.add("map", "odom", 0, shifted(8));
  in_odom.add("map", "odom", 90, shifted(8));
  TransformTree tf(1000), own(1000, 1000, &tf);
  tf.add("map", "odom", 40, shifted(8));
  tf.add("map", "odom", 60, shifted(8));
  tf.add("odom", "base", 0, shifted(0));
  tf.add("odom", "base", 100, shifted(1));
  tf.set_static("base", "camera", shifted(0.25));
  in_map.set_static("base", "camera", shifted(0.25));
  in_odom.set_static("base", "camera", shifted(0.25));
  for (const TransformTree* tree : {&in_map, &in_odom, &own}) {
    const TransformLookup found = tree->lookup("map", "camera", 50, 0);
    ASSERT_EQ(found.result, PoseLookup::kFound) << found.edge;
    EXPECT_EQ(x_of(found), 8.75);  // all are sums of powers of two
    EXPECT_TRUE(found.edge.empty());
  }
  // Half way of map -> odom there is no pose yet; it may be held for so long and no longer.
  EXPECT_EQ(in_odom.lookup("map", "camera", 95, 4).edge, "map -> odom");
  EXPECT_EQ(in_odom.lookup("map", "camera", 95, 4).result, PoseLookup::kTooNew);
  EXPECT_EQ(in_odom.lookup("map", "camera", 95, 5).result, PoseLookup::kFound);
}

TEST(TransformTree, OwnOdometryGoesBeforeWhatTfSaysOfTheSameFrame) {
  TransformTree tf(1000), own(1000, 1000, &tf);
  tf.add("odom", "base", 0, shifted(5));
  own.add("map", "base", 0, shifted(1));
  EXPECT_EQ(x_of(own.lookup("map", "base", 0, 0)), 1.0);
  own.forget_moving();
  EXPECT_EQ(own.lookup("map", "base", 0, 0).edge, "? -> odom");
}

TEST(TransformTree, FailuresNameTheFrames) {
  TransformTree tree(100);
  tree.set_static("base", "camera", {});
  tree.add("odom", "base", 1'000'000'000, {});
  const auto said = [&](StampNs stamp_ns) {
    return tree.explain("map", "camera", stamp_ns, tree.lookup("map", "camera", stamp_ns, 0));
  };
  EXPECT_EQ(said(1'000'000'000).reason, InputReason::kNoTransform);
  EXPECT_EQ(said(1'000'000'000).detail,
            "no transform leads from \"camera\" to \"map\": nobody says where \"odom\" is "
            "(camera <- base <- odom); is it the frame of the map? (--set node.map_frame=odom)");
  EXPECT_EQ(said(1'500'000'000).reason, InputReason::kNoPose);
  EXPECT_EQ(said(1'500'000'000).detail,
            "odom -> base: newest pose is of 1.000 s, the image of 1.500 s; it came once: a "
            "transform that does not change belongs on tf_static");
  EXPECT_EQ(said(900'000'000).detail,
            "odom -> base: oldest pose is of 1.000 s, the image of 0.900 s");
  tree.add("odom", "base", 2'000'000'000, {});
  EXPECT_EQ(said(1'500'000'000).detail,
            "odom -> base: no pose is between 1.000 s and 2.000 s, the image is of 1.500 s "
            "(--set node.max_pose_gap_s=1.0 interpolates over so long)");
  EXPECT_EQ(said(2'450'000'000).detail,
            "odom -> base: newest pose is of 2.000 s, the image of 2.450 s; "
            "--set node.extrapolation_s=0.5 holds that pose");
  tree.set_static("camera", "odom", {});
  EXPECT_EQ(said(1'000'000'000).reason, InputReason::kTransformLoop);
  EXPECT_EQ(said(1'000'000'000)
                .detail.find("frames go round in a loop and never reach \"map\": "
                             "camera <- base <- odom <- camera"),
            0u)
      << said(1'000'000'000).detail;
}

// As tf2: an odometry that is sent inverted makes the map a child of the robot.
TEST(TransformTree, TheMapNeedNotBeAnAncestorOfTheCamera) {
  TransformTree tree(1'000'000'000);
  tree.set_static("base", "camera", shifted(1));
  tree.add("base", "map", 0, shifted(-5));
  tree.add("base", "map", 1'000'000'000, shifted(-7));
  EXPECT_EQ(x_of(tree.lookup("map", "camera", 500'000'000, 0)), 7.0);
  TransformTree star(100);
  star.add("earth", "map", 0, shifted(10));
  star.add("earth", "base", 0, shifted(12));
  star.set_static("base", "camera", shifted(1));
  EXPECT_EQ(x_of(star.lookup("map", "camera", 0, 0)), 3.0);
  // What fails on the way down from the common frame is named, too.
  const TransformLookup late = tree.lookup("map", "camera", 3'000'000'000, 0);
  EXPECT_EQ(late.result, PoseLookup::kTooNew);
  EXPECT_EQ(tree.explain("map", "camera", 3'000'000'000, late).detail,
            "base -> map: newest pose is of 1.000 s, the image of 3.000 s");
  star.set_static("mars", "rover", {});
  EXPECT_EQ(star.lookup("rover", "camera", 0, 0).result, PoseLookup::kEmpty);
}

TEST(TransformTree, ARenamedParentIsSaid) {
  TransformTree tree(100);
  EXPECT_FALSE(tree.add("odom", "base", 0, {}));
  EXPECT_FALSE(tree.add("odom", "base", 10, {}));
  auto problem = tree.add("odometry", "base", 20, {});
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->reason, InputReason::kParentChanged);
  EXPECT_EQ(problem->detail, "frame \"base\" had parent \"odom\", now \"odometry\"");
  EXPECT_EQ(tree.lookup("odometry", "base", 20, 0).result, PoseLookup::kFound);
  problem = tree.add("odometry", "base", 19, {});
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->reason, InputReason::kStampBackwards);
  EXPECT_NE(problem->detail.find("odometry -> base"), std::string::npos);
  EXPECT_FALSE(tree.set_static("base", "camera", {}));
  EXPECT_FALSE(tree.set_static("base", "camera", {}));
  EXPECT_TRUE(tree.set_static("mast", "camera", {}));
}

TEST(TransformTree, NamesWithoutEndDoNotTakeMemoryWithoutEnd) {
  TransformTree tree(100);
  EXPECT_FALSE(tree.add("odom", "base", 0, {}));
  std::optional<InputProblem> problem;
  int frames = 1;
  for (; !problem && frames < 100000; ++frames) {
    problem = tree.add("base", "frame" + std::to_string(frames), 0, {});
  }
  ASSERT_TRUE(problem);
  EXPECT_EQ(frames, 10001) << "10,000 and the one that is left out";
  EXPECT_EQ(problem->reason, InputReason::kTooLarge);
  EXPECT_TRUE(tree.set_static("base", "camera", {}));
  EXPECT_FALSE(tree.add("odom", "base", 1, {})) << "known frames go on";
}

TEST(TransformTree, ForgetsARobotAndNothingElse) {
  TransformTree tf(100), own(100, 1000, &tf);
  for (const std::string robot : {"a", "b"}) {
    tf.add("map", robot + "/odom", 0, {});
    tf.add(robot + "/odom", robot + "/base", 0, {});
    tf.add(robot + "/base", robot + "/wheel", 0, {});
    tf.set_static(robot + "/base", robot + "/camera", {});
  }
  const auto frames = own.chain("map", "a/camera");
  EXPECT_EQ(frames, (std::vector<std::string>{"a/camera", "a/base", "a/odom"}));
  tf.forget_moving(frames);
  for (const char* frame : {"a/odom", "a/base", "a/wheel"}) {
    EXPECT_EQ(tf.lookup("map", frame, 0, 0).result, PoseLookup::kEmpty) << frame;
    // It may come back at any stamp.
    EXPECT_FALSE(tf.add("map", frame, -1000, {})) << frame;
  }
  EXPECT_EQ(tf.lookup("a/base", "a/camera", 0, 0).result, PoseLookup::kFound) << "static";
  for (const char* frame : {"b/odom", "b/base", "b/wheel", "b/camera"}) {
    EXPECT_EQ(tf.lookup("map", frame, 0, 0).result, PoseLookup::kFound) << frame;
  }
}

// The synchroniser hands on why a frame had no pose, once it has been waited for.
TEST(TransformTree, SynchroniserSaysWhyAFrameHadNoPose) {
  constexpr StampNs kMs = 1'000'000;
  TransformTree tree(1000 * kMs);
  tree.set_static("base", "camera", {});
  SynchronizerConfig config;
  config.segmentation = StreamUse::kAbsent;
  config.camera_frame = "camera";
  TimeSynchronizer synchronizer(config, tree);
  for (int i = 1; i <= 5; ++i) {
    synchronizer.add_camera_info(i * 100 * kMs, CameraModel{4, 3, 1, 1, 1, 1});
    synchronizer.add_image(TimeSynchronizer::Stream::kDepth, i * 100 * kMs,
                           cv::Mat(3, 4, CV_16UC1, cv::Scalar(1)));
  }
  EXPECT_TRUE(synchronizer.take().empty());
  EXPECT_EQ(synchronizer.blocked_by(), TimeSynchronizer::Stream::kPose);
  EXPECT_NE(synchronizer.waiting_for().find("waiting for pose (? -> base) since"),
            std::string::npos);
  const auto lacks = synchronizer.take_lacks();
  ASSERT_EQ(lacks.size(), 1u) << "the first one was dropped";
  EXPECT_EQ(lacks[0].stream, TimeSynchronizer::Stream::kPose);
  EXPECT_EQ(lacks[0].problem.reason, InputReason::kNoTransform);
  EXPECT_EQ(lacks[0].times, 1u);
  EXPECT_TRUE(synchronizer.take_lacks().empty()) << "said once";
}

}  // namespace
}  // namespace pocd
