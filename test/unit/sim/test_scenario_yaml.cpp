#include "pocd/sim/scenario_yaml.hpp"

#include <gtest/gtest.h>

#include "../datasets/scratch_folder.hpp"
#include "pocd/common/check.hpp"
#include "pocd/sim/truth.hpp"

namespace pocd {
namespace {

const std::string kHead =
    "name: test\nrobots: [{name: r, path: {waypoints: [[0, 0], [1, 0]], closed: false}}]\n";
const std::string kBox = "objects: [{name: box, class: 7, at: [1, 2, 90], size: [1, 0.5, 2]}]\n";

/// The text of the error that loading gives, "" for none.
std::string error_of(const std::string& yaml) {
  const ScratchFolder folder;
  folder.write("s.yaml", yaml);
  try {
    load_scenario(folder / "s.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ScenarioYaml, ReadsObjectsAndChanges) {
  const ScratchFolder folder;
  folder.write(
      "s.yaml",
      kHead + kBox +
          "visits:\n"
          "- {name: a}\n"
          "- name: b\n"
          "  changes:\n"
          "  - {move: box, by: [0.5, 0, 10]}\n"
          "  - {add: {name: new, class: 9, shape: cylinder, size: [1, 1, 2], at: [-2, 0, 0]}}\n"
          "- name: c\n"
          "  changes:\n"
          "  - {remove: box}\n"
          "  - {drive: new, track: [[0, -2, 0, 0], [5, -2, 3, 90]]}\n"
          "  - {pass: {name: p, class: 13, size: [0.4, 0.4, 1.7]}, track: [[0, 0, 0, 0], [3, 1, 1, "
          "0]]}\n"
          "- {name: d}\n");
  const Scenario scenario = load_scenario(folder / "s.yaml");
  ASSERT_EQ(scenario.visits.size(), 4u);
  const OrientedBox box = objects_after(scenario, 1).at(0).box;
  EXPECT_NEAR((box.pose.position_W - Eigen::Vector3d(1.5, 2, 1)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(box.pose.yaw_rad, 100 * M_PI / 180, 1e-12);
  const auto moved = changes_of(scenario, 1);
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[0].kind, ChangeKind::kMoved);
  EXPECT_EQ(moved[1].kind, ChangeKind::kAdded);
  const auto driven = changes_of(scenario, 2);
  ASSERT_EQ(driven.size(), 2u);
  EXPECT_EQ(driven[0].kind, ChangeKind::kRemoved);
  EXPECT_EQ(driven[1].name, "new");
  EXPECT_NEAR(driven[1].after->pose.position_W.y(), 3.0, 1e-12);
  EXPECT_TRUE(changes_of(scenario, 3).empty());
  EXPECT_EQ(scene_at(scenario, 2, 1.0).objects.size(), scenario.fixtures.size() + 2);
  EXPECT_EQ(scene_at(scenario, 2, 4.0).objects.size(), scenario.fixtures.size() + 1);
}

TEST(ScenarioYaml, LeaningThingsStandOnTheFloor) {
  const ScratchFolder folder;
  folder.write("s.yaml",
               kHead + "objects: [{name: b, class: 7, size: [1, 0.1, 1.5], lean_deg: -20}]\n");
  const Scenario scenario = load_scenario(folder / "s.yaml");
  const OrientedBox box = objects_after(scenario, 0).at(0).box;
  EXPECT_NEAR(box.pose.position_W.z() - 0.5 * box.size_m.z(), 0.0, 1e-12);
  folder.write("t.yaml", "name: t\nbase: s.yaml\nchanges: [{move: b, to: [2, 1, 90]}]\n");
  const OrientedBox moved = objects_after(load_scenario(folder / "t.yaml"), 0).at(0).box;
  EXPECT_NEAR((moved.size_m - box.size_m).norm(), 0.0, 1e-12);
  EXPECT_NEAR(moved.pose.position_W.z(), box.pose.position_W.z(), 1e-12);
  EXPECT_NEAR(moved.pose.yaw_rad, M_PI / 2, 1e-12);
}

TEST(ScenarioYaml, MeshesAndSensorsAreFilesBesideTheScenarioOrItsBase) {
  const ScratchFolder folder;
  folder.write("stage/shapes/wedge.obj", "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 0.5\nf 1 2 4\nf 2 3 4\n");
  folder.write("stage/far.yaml", "max_range_m: 4\nflying_px: 2\n");
  folder.write("stage/base.yaml", kHead + "sensor: far.yaml\nkinds: {wedge: {class: 9, mesh: shapes/wedge.obj}}\n");
  folder.write("s.yaml",
               "name: s\nbase: stage/base.yaml\nobjects:\n"
               "- {name: a, kind: wedge, at: [1, 2, 90]}\n"
               "- {name: b, class: 7, z: 1, parts: [{mesh: shapes/wedge.obj, scale: 2, at: [0, 0, 1]}]}\n");
  const Scenario scenario = load_scenario(folder / "s.yaml");
  EXPECT_EQ(scenario.sensor.max_range_m, 4.0);
  EXPECT_EQ(scenario.sensor.flying_px, 2.0);
  EXPECT_EQ(scenario.sensor.depth_base_m, SensorModel().depth_base_m);
  const auto objects = objects_after(scenario, 0);
  EXPECT_NEAR((objects[0].box.size_m - Eigen::Vector3d(2, 1, 0.5)).norm(), 0.0, 1e-6);
  EXPECT_NEAR((objects[0].box.pose.position_W - Eigen::Vector3d(1, 2, 0.25)).norm(), 0.0, 1e-6);
  EXPECT_NEAR((objects[1].box.size_m - Eigen::Vector3d(4, 2, 1)).norm(), 0.0, 1e-6);
  EXPECT_NEAR(objects[1].box.pose.position_W.z(), 2.5, 1e-6);
}

TEST(ScenarioYaml, UnknownKeysNameFileAndKey) {
  for (const std::string& yaml :
       {kHead + "colour: red\n", kHead + kBox.substr(0, kBox.size() - 3) + ", colour: 1}]\n",
        kHead + "visits: [{name: a, colour: 1}]\n", kHead + "sensor: {colour: 1}\n",
        kHead + "area: {low: [-5, -5], high: [5, 5], colour: 1}\n",
        kHead + kBox + "changes: [{remove: box, colour: 1}]\n"}) {
    const std::string error = error_of(yaml);
    EXPECT_NE(error.find("s.yaml"), std::string::npos) << yaml << error;
    EXPECT_NE(error.find("'colour'"), std::string::npos) << yaml << error;
  }
}

TEST(ScenarioYaml, OneDefectOneLine) {
  const std::pair<std::string, std::string> cases[] = {
      {"robots: []\n", "'name' is missing"},
      {"name: x\n", "no robots"},
      {"name: [\n", "s.yaml:"},
      {"just text\n", "must be a map"},
      {kHead + "objects: [{name: b, class: 7}]\n", "'size' is missing"},
      {kHead + "objects: [{name: b, class: 7, size: [1, 2]}]\n", "3 numbers"},
      {kHead + "objects: [{name: b, class: 7, size: [1, 2, .nan]}]\n", "3 numbers"},
      {kHead + "objects: [{name: b, class: 7, size: [1, 2, 0]}]\n", "not > 0"},
      {kHead + "objects: [{name: b, class: seven, size: [1, 2, 3]}]\n", "an integer"},
      {kHead + "objects: [{name: b, class: 7, size: [1, 2, 3], shape: cone}]\n",
       "key 'shape' \"cone\" is not one of: box, cylinder"},
      {kHead + "objects: [{name: b, kind: k, size: [1, 2, 3]}]\n", "'k'"},
      {kHead + "objects: [{name: b, class: 7, size: [1, 1, 1], at: [6.4, 0, 0]}]\n",
       "outside the area"},
      {kHead + kBox + "changes: [{remove: bax}]\n", "'bax'"},
      {kHead + kBox + "changes: [{move: box}]\n", "'by'"},
      {kHead + kBox + "changes: [{teleport: box}]\n", "none of"},
      {kHead + kBox + "changes: [{add: {name: box, class: 7, size: [1, 1, 1]}}]\n", "two objects"},
      {kHead + "sensor: great\n", "'great'"},
      {kHead + "sensor: great.yaml\n", "'great.yaml'"},
      {kHead + "objects: [{name: b, class: 7, mesh: no.obj}]\n", "no file 'no.obj'"},
      {kHead + "objects: [{name: b, class: 7, mesh: s.yaml}]\n", "s.yaml:1: unknown keyword"},
      {kHead + "objects: [{name: b, class: 7, mesh: s.yaml, scale: 0}]\n", "'scale' must be > 0"},
      {kHead + "objects: [{name: b, class: 7, mesh: s.yaml, scale: x}]\n", "a number"},
      {kHead + "sensor: {random_hole_share: 2}\n", "must be in"},
      {kHead + "base: missing.yaml\n", "missing.yaml"},
      {kHead + "base: s.yaml\n", "too deeply"},
      {kHead + "camera: {width: 640, height: 480, fx: 0, fy: 1, cx: 1, cy: 1}\n", "fx"},
  };
  for (const auto& [yaml, expected] : cases) {
    const std::string error = error_of(yaml);
    EXPECT_NE(error.find(expected), std::string::npos) << yaml << " -> " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST(ScenarioYaml, RunsMustFitTogether) {
  const ScratchFolder folder;
  folder.write("a.yaml", kHead + kBox);
  folder.write("b.yaml", "name: b\nbase: a.yaml\nchanges: [{remove: box}]\n");
  folder.write("c.yaml", "name: c\nbase: a.yaml\nbase_height_m: 0.5\n");
  const Scenario run = load_run({folder / "a.yaml", folder / "b.yaml"});
  ASSERT_EQ(run.visits.size(), 2u);
  EXPECT_EQ(changes_of(run, 1).size(), 1u);
  EXPECT_THROW(load_run({folder / "a.yaml", folder / "c.yaml"}), InputError);
  EXPECT_THROW(load_run({}), InputError);
}

}  // namespace
}  // namespace pocd
