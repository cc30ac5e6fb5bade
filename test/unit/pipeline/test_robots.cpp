// What is known of one robot is not mixed up with another's, and ends.
#include <cmath>
#include <functional>

#include "drive.hpp"
#include "pocd/common/check.hpp"

namespace pocd::test {
namespace {

// Masks end for good: after a while the robot is one without masks, said once.
TEST(PipelineRobots, ARobotWhoseMasksEndMapsAgain) {
  PipelineConfig config = room_config();
  config.mask_timeout_s = 2.0;
  config.classes.default_class = kBoxClass;
  Drive drive(config);
  const Scene scene = room_with({solid(kBoxClass, {-0.6, 2.3}, {0.6, 0.6, 0.8})});
  drive.watch(scene, 10);
  const std::size_t blocks = drive.pipeline().map().block_count();
  int missing = 0, said = 0, quiet = 0;
  for (int i = 0; i < 60; ++i) {
    Frame frame = drive.next_frame(scene);
    frame.labels.release();
    const FrameResult result = drive.process(frame);
    EXPECT_TRUE(result.accepted);
    if (result.warnings.empty()) {
      ++quiet;
    } else if (result.warnings[0].find("no segmentation image: nothing is added") == 0) {
      EXPECT_EQ(quiet + said, 0);
      ++missing;
    } else {
      EXPECT_EQ(result.warnings[0].find("no segmentation image for 2 s: mapped without"), 0u)
          << result.warnings[0];
      ++said;
    }
  }
  // 15 frames a second: the mask of frame 9 is 2 s old in frame 39.
  EXPECT_NEAR(missing, 30, 1);
  EXPECT_EQ(said, 1);
  EXPECT_EQ(quiet, 60 - missing - 1);
  EXPECT_GT(drive.pipeline().map().block_count(), blocks / 2);
  // Masks come back: a gap is one again.
  drive.watch(scene, 1);
  Frame frame = drive.next_frame(scene);
  frame.labels.release();
  EXPECT_EQ(drive.process(frame).warnings.size(), 1u);
}

// Front and rear camera of one robot look from two places at once: neither is a jump.
TEST(PipelineRobots, TwoCamerasOfARobotAreNoJumps) {
  PoseGate gate{PoseGateConfig{}};
  for (const bool named : {true, false}) {
    int refused = 0;
    for (int i = 0; i < 100; ++i) {
      Frame frame;
      frame.robot = named ? "named" : "nameless";
      frame.stamp_ns = 1'000'000'000 + i * 33'000'000;
      frame.T_W_C.translation().x() = 0.02 * i + (i % 2 ? 0.8 : 0.0);
      frame.T_W_C.linear() =
          Eigen::AngleAxisd(i % 2 ? M_PI : 0.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      if (named) frame.camera_frame = i % 2 ? "rear" : "front";
      refused += gate.refuse(frame).has_value();
    }
    EXPECT_EQ(refused > 0, !named) << refused;
  }
}

// One robot is half a metre lower, down a ramp, and sees no floor there: what lies below the other
// robot's floor is not floor for that.
TEST(PipelineRobots, EachRobotHasItsGround) {
  Drive drive;
  const Scene scene = room_with({solid(kBoxClass, {-0.6, 2.3}, {0.6, 0.6, 0.8})});
  Scene no_floor = scene;
  no_floor.objects.erase(no_floor.objects.begin());
  for (int i = 0; i < 60; ++i) {
    Frame frame = drive.next_frame(i % 2 ? no_floor : scene);
    frame.robot = i % 2 ? "below" : "above";
    if (i % 2) frame.T_W_C.translation() += Eigen::Vector3d(20.0, 0.0, -0.5);
    drive.process(frame);
  }
  const auto above = drive.object_at(-0.6, 2.3), below = drive.object_at(19.4, 2.3);
  ASSERT_TRUE(above && below);
  EXPECT_NEAR(above->box.size_m.z(), below->box.size_m.z(), 0.12);  // the foot is seen or not
}

// A configuration that C++ made is checked like one of a file.
TEST(PipelineConfigCheck, EveryBadValueIsNamed) {
  const auto error_of = [](const PipelineConfig& config) -> std::string {
    try {
      PocdPipeline pipeline(config);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of(PipelineConfig{}), "");
  const auto with = [&](const std::function<void(PipelineConfig&)>& change) {
    PipelineConfig config;
    change(config);
    return error_of(config);
  };
  const std::pair<std::string, std::string> cases[] = {
      {with([](auto& c) { c.segmentation.stride = 0; }), "segmentation.stride: 0 is not in 1 to 8"},
      {with([](auto& c) { c.threads = 0; }), "threads: 0"},
      {with([](auto& c) { c.map.voxel_size_m = std::nan(""); }), "map.voxel_size_m: nan"},
      {with([](auto& c) { c.change.measure = static_cast<ChangeMeasure>(7); }),
       "change.measure: \"7\" is not one of: projective, ray_traced"},
      {with([](auto& c) { c.map.memory.limit = "bugdet"; }),
       "map.memory.limit: \"bugdet\" is not one of: none, budget"},
      {with([](auto& c) { c.classes.list = {{1, "a", "objct", 0, ""}}; }),
       "classes.list[0].role: \"objct\" is not one of"},
      {with([](auto& c) { c.classes.list = {{1, "a", "object", 2, ""}}; }),
       "classes.list[0].stationarity_class: 2"},
      {with([](auto& c) { c.classes.list = {{1, "a", "object", 0, ""}, {1, "b", "object", 0, ""}}; }),
       "classes: list[1].id"},
  };
  for (const auto& [error, expected] : cases) {
    EXPECT_NE(error.find("pipeline: " + expected), std::string::npos) << error;
  }
  const std::string both = with([](auto& c) { c.segmentation.stride = 0, c.state.max_count = -1; });
  EXPECT_NE(both.find("segmentation.stride"), std::string::npos) << both;
  EXPECT_NE(both.find("state.max_count"), std::string::npos) << both;
}

}  // namespace
}  // namespace pocd::test
