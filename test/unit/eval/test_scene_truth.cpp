#include "pocd/eval/scene_truth.hpp"

#include <gtest/gtest.h>

#include "pocd/sim/sim_reader.hpp"
#include "pocd/sim/triangle_mesh.hpp"

namespace pocd {
namespace {

SceneObject box_object(const std::string& name, double x, double y) {
  SceneObject object;
  object.name = name;
  object.class_id = 7;
  object.T_W_O = upright_pose({x, y, 0}, 0.0);
  ScenePart part;
  part.size_m = {0.5, 0.5, 1.0};
  part.T_O_P = upright_pose({0, 0, 0.5}, 0.0);
  object.parts = {part};
  return object;
}

/// A robot drives 4 m along x at y = 0; between two visits "near" goes away and "far" comes. "far"
/// stands beside the end of the path, "never" where no camera sees it.
Scenario two_visits() {
  Scenario scenario;
  scenario.name = "two visits";
  scenario.camera = torwic_camera();
  scenario.extrinsics = torwic_extrinsics();
  scenario.fixtures = make_building({-6, -6}, {12, 6}, 3.0, 1, 0);
  scenario.area_low_m = {-6, -6}, scenario.area_high_m = {12, 6};
  SimRobot robot;
  robot.name = "robot";
  robot.path.waypoints_m = {{0, 0}, {4, 0}};
  robot.path.closed = false;
  robot.path.speed_m_s = 1.0;
  scenario.robots = {robot};
  scenario.visits = {{"before", {box_object("near", 2.5, 0.8), box_object("never", -3, 0)}},
                     {"after", {box_object("far", 6, 0.8)}}};
  return scenario;
}

TEST(SceneTruth, KnowsWhenAChangeIsInClearSight) {
  const Scenario scenario = two_visits();
  SceneTruthOptions options;
  const SceneTruth truth = scene_truth(scenario, options, nullptr);
  ASSERT_EQ(truth.visit_begin.size(), 3u);
  ASSERT_EQ(truth.changes.size(), 3u);
  const std::size_t begin = truth.visit_begin[1];
  EXPECT_EQ(truth.changes[0].change.name, "near");
  ASSERT_TRUE(truth.changes[0].clear_frame());
  // 2.5 m ahead it is within the depth limit at once; its far side never faces the camera.
  EXPECT_LT(*truth.changes[0].clear_frame(), begin + 15);
  EXPECT_EQ(truth.changes[1].change.name, "never");
  EXPECT_FALSE(truth.changes[1].clear_frame()) << "behind the robot all the time";
  EXPECT_EQ(truth.changes[2].change.name, "far");
  ASSERT_TRUE(truth.changes[2].clear_frame());
  // Its near face is at 5.75 m: within 3 m once the camera is past 2.75 m, which takes over two
  // seconds.
  EXPECT_GT(*truth.changes[2].clear_frame(), begin + 30);
}

TEST(SceneTruth, AChangeBehindAScreenIsAskedWhenTheScreenIsGone) {
  Scenario scenario = two_visits();
  SceneObject screen = box_object("screen", 4.5, 1.0);
  screen.parts[0].size_m = {9.0, 0.1, 2.0};
  screen.parts[0].T_O_P = upright_pose({0, 0, 1.0}, 0.0);
  const SceneObject hidden = box_object("hidden", 4.5, 1.6), late = box_object("late", 5.5, 1.6);
  scenario.visits = {{"before", {screen}},
                     {"behind", {screen, hidden, late}},
                     {"in sight", {hidden}},
                     {"after", {hidden}}};
  const SceneTruth truth = scene_truth(scenario, SceneTruthOptions(), nullptr);
  ASSERT_EQ(truth.changes.size(), 4u);
  for (const SeenChange& seen : truth.changes) {
    EXPECT_EQ(seen.visit,
              seen.change.kind == ChangeKind::kAdded && seen.change.name == "late" ? 1u : 2u)
        << seen.change.name << ": what came and went unseen stays where it was";
    EXPECT_EQ(seen.clear_frame().has_value(), seen.change.name != "late" || seen.visit == 2)
        << seen.change.name;
  }
}

TEST(SceneTruth, SurfaceDistanceIsExactForABox) {
  Scene scene;
  scene.objects = {box_object("a", 0, 0)};
  EXPECT_NEAR(surface_distance(scene, {0.5, 0, 0.5}, 9.0), 0.25, 1e-12);
  EXPECT_NEAR(surface_distance(scene, {0, 0, 0.5}, 9.0), 0.25, 1e-12) << "inside";
  EXPECT_NEAR(surface_distance(scene, {0.55, 0.65, 0.5}, 9.0), 0.5, 1e-12) << "an edge";
  EXPECT_NEAR(surface_distance(scene, {9, 0, 0}, 1.0), 1.0, 1e-12) << "limited";
}

/// A frame of four thin posts, 0.5 x 0.5 x 1 m: next to nothing of it lies on the faces of its box.
SceneObject posts(const std::string& name, double x, double y) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3i> triangles;
  for (const float px : {-0.15f, 0.15f}) {
    for (const float py : {-0.15f, 0.15f}) {
      // A leaning blade: it touches the box's faces with its ends only.
      const int first = static_cast<int>(vertices.size());
      for (const float z : {0.0f, 1.0f}) {
        const float lean = (px > 0 ? 0.1f : -0.1f) * z;
        vertices.emplace_back(px + lean, py - 0.05f, z);
        vertices.emplace_back(px + lean, py + 0.05f, z);
      }
      triangles.emplace_back(first, first + 1, first + 2);
      triangles.emplace_back(first + 1, first + 3, first + 2);
    }
  }
  SceneObject object = box_object(name, x, y);
  object.parts[0].shape = Shape::kMesh;
  object.parts[0].mesh = std::make_shared<const TriangleMesh>(vertices, triangles, "posts");
  object.parts[0].size_m = object.parts[0].mesh->size_m();
  return object;
}

TEST(SceneTruth, AMeshIsSeenByItsSurfaceAndNotByItsBox) {
  Scenario scenario = two_visits();
  scenario.visits = {{"before", {posts("gone", 2.5, 0.8)}}, {"after", {posts("come", 6, 0.8)}}};
  const SceneTruth truth = scene_truth(scenario, SceneTruthOptions(), nullptr);
  ASSERT_EQ(truth.changes.size(), 2u);
  for (const SeenChange& seen : truth.changes) {
    ASSERT_TRUE(seen.clear_frame()) << seen.change.name;
  }
  EXPECT_LT(*truth.changes[0].clear_frame(), truth.visit_begin[1] + 15);
  EXPECT_GT(*truth.changes[1].clear_frame(), truth.visit_begin[1] + 30);
  Scene scene;
  scene.objects = {posts("a", 0, 0)};
  EXPECT_NEAR(surface_distance(scene, {0.15, -0.15, 0.0}, 1.0), 0.0, 1e-6);
  EXPECT_GT(surface_distance(scene, {0.0, 0.0, 0.5}, 1.0), 0.15) << "the middle is free";
  EXPECT_EQ(surface_distance(scene, {9, 0, 0}, 1.0), 1.0) << "limited";
}

TEST(SceneTruth, VisibleSurfaceIsOfTheLastVisitAndNoFloor) {
  const SceneTruth truth = scene_truth(two_visits(), SceneTruthOptions(), nullptr);
  ASSERT_FALSE(truth.surface.visible.empty());
  for (const VoxelIndex& voxel : truth.surface.visible) {
    EXPECT_GE(voxel.x, 114) << "only the thing at x = 5.75 m and beyond";  // 0.05 m voxels
  }
}

}  // namespace
}  // namespace pocd
