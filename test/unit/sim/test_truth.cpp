#include "pocd/sim/truth.hpp"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

SceneObject box_object(const std::string& name, const Eigen::Vector3d& base_m,
                       const Eigen::Vector3d& size_m) {
  SceneObject object;
  object.name = name;
  object.class_id = 7;
  object.T_W_O = upright_pose(base_m, 0.0);
  ScenePart part;
  part.size_m = size_m;
  part.T_O_P = upright_pose({0, 0, 0.5 * size_m.z()}, 0.0);
  object.parts.push_back(part);
  return object;
}

/// A robot that drives 0.5 m along +x towards a wall at x = 2, with a box in front of it and
/// another hidden behind it.
Scenario small_scenario() {
  Scenario scenario;
  scenario.name = "small";
  scenario.camera = {320, 240, 200, 200, 159.5, 119.5};
  scenario.extrinsics.T_B_C.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  scenario.base_height_m = 0.5;
  SimRobot robot;
  robot.name = "r";
  robot.path.waypoints_m = {{0, 0}, {0.5, 0}};
  robot.path.closed = false;
  scenario.robots.push_back(robot);
  scenario.sensor = SensorModel::perfect();
  scenario.visits.push_back({"a",
                             {box_object("front", {1.51, 0.013, 0}, {0.2, 0.4, 0.6}),
                              box_object("wall", {2.1, 0, 0}, {0.18, 4, 2}),
                              box_object("behind", {3, 0, 0}, {0.4, 0.4, 0.4})}});
  return scenario;
}

TEST(Truth, VisibleSurfaceIsWhatTheCameraFaces) {
  const Scenario scenario = small_scenario();
  VisibleSurfaceOptions options;
  options.voxel_size_m = 0.1;
  options.max_depth_m = 3.0;
  const std::vector<SurfaceVoxel> voxels = visible_surface(scenario, 0, options);
  const Scene scene = scene_at(scenario, 0, 0.0);
  std::set<std::tuple<int, int, int>> front;
  for (const SurfaceVoxel& voxel : voxels) {
    const std::string& name = scene.objects.at(voxel.object).name;
    EXPECT_NE(name, "behind");
    if (name == "front") front.insert({voxel.x, voxel.y, voxel.z});
    // Only the wall's near face (x = 2.01) is in sight.
    if (name == "wall") {
      EXPECT_EQ(voxel.x, 20);
    }
  }
  // The near face of the front box lies at x = 1.41 and covers y in [-0.187, 0.213], z in [0, 0.6]:
  // all of its voxels are seen, 5 in y and 6 in z. Its top is 10 cm above the camera and not seen.
  for (int y = -2; y <= 2; ++y) {
    for (int z = 0; z <= 5; ++z) EXPECT_TRUE(front.count({14, y, z})) << y << " " << z;
  }
  EXPECT_EQ(front.size(), 30u);
  options.max_depth_m = 1.2;  // the wall is 1.5 m away at the end, the box 0.9 m
  for (const SurfaceVoxel& voxel : visible_surface(scenario, 0, options)) {
    EXPECT_NE(scene.objects.at(voxel.object).name, "wall");
  }
}

TEST(Truth, VisibleSurfaceIsSortedAndTheSameForEveryPool) {
  const Scenario scenario = small_scenario();
  VisibleSurfaceOptions options;
  ThreadPool pool(3);
  const auto one = visible_surface(scenario, 0, options);
  const auto three = visible_surface(scenario, 0, options, &pool);
  ASSERT_EQ(one.size(), three.size());
  ASSERT_GT(one.size(), 100u);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_TRUE(one[i].x == three[i].x && one[i].y == three[i].y && one[i].z == three[i].z &&
                one[i].object == three[i].object);
    if (i == 0) continue;
    EXPECT_LT(std::tie(one[i - 1].z, one[i - 1].y, one[i - 1].x),
              std::tie(one[i].z, one[i].y, one[i].x));
  }
}

TEST(Truth, ThingsThatMoveGiveNoSurface) {
  Scenario scenario = small_scenario();
  scenario.visits[0].objects[0].track = {{0.0, {1.51, 0.013}, 0.0}, {5.0, {1.6, 0.5}, 0.0}};
  const Scene scene = scene_at(scenario, 0, 1e9);
  for (const SurfaceVoxel& voxel : visible_surface(scenario, 0, {})) {
    EXPECT_NE(scene.objects.at(voxel.object).name, "front");
  }
}

TEST(Truth, ChangesByKind) {
  Scenario scenario = small_scenario();
  scenario.visits.push_back(scenario.visits[0]);
  auto& after = scenario.visits[1].objects;
  EXPECT_TRUE(changes_of(scenario, 1).empty());
  after[0].T_W_O.translation().x() += 0.0005;  // below the millimetre that counts
  EXPECT_TRUE(changes_of(scenario, 1).empty());
  after[0].T_W_O.translation().x() += 0.1;
  after[1].parts[0].size_m.x() = 0.3;  // another thing with the same name
  after[2].name = "other";
  const auto changes = changes_of(scenario, 1);
  ASSERT_EQ(changes.size(), 5u);
  const std::pair<ChangeKind, std::string> expected[] = {{ChangeKind::kMoved, "front"},
                                                         {ChangeKind::kRemoved, "wall"},
                                                         {ChangeKind::kRemoved, "behind"},
                                                         {ChangeKind::kAdded, "wall"},
                                                         {ChangeKind::kAdded, "other"}};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(changes[i].kind, expected[i].first) << i;
    EXPECT_EQ(changes[i].name, expected[i].second) << i;
    EXPECT_EQ(changes[i].before.has_value(), changes[i].kind != ChangeKind::kAdded);
    EXPECT_EQ(changes[i].after.has_value(), changes[i].kind != ChangeKind::kRemoved);
  }
}

}  // namespace
}  // namespace pocd
