// Every scenario under config/sim: loads, is consistent, and shows what it is about.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/triangle_mesh.hpp"
#include "pocd/sim/truth.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> shipped() {
  std::vector<fs::path> files;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(POCD_SOURCE_DIR) / "config/sim")) {
    const bool sensor = entry.path().parent_path().filename() == "sensors";
    if (entry.path().extension() == ".yaml" && !sensor) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

fs::path torwic(const std::string& name) {
  return fs::path(POCD_SOURCE_DIR) / "config/sim/torwic" / (name + ".yaml");
}

/// Points of a's meshes lie in b's solids; the boxes of meshes say nothing, since things lie in them.
bool meshes_reach_into(const SceneObject& a, const SceneObject& b) {
  for (const ScenePart& mesh : a.parts) {
    if (mesh.shape != Shape::kMesh) continue;
    for (const Eigen::Vector3f& point : mesh.mesh->sample(2000)) {
      for (const ScenePart& solid : b.parts) {
        if (solid.shape == Shape::kMesh) continue;
        const Eigen::Vector3d p =
            (b.T_W_O * solid.T_O_P).inverse() * (a.T_W_O * mesh.T_O_P * point.cast<double>());
        const Eigen::Vector3d half = 0.5 * solid.size_m;
        const bool across = solid.shape == Shape::kBox
                                ? std::abs(p.x()) < half.x() - 1e-5 && std::abs(p.y()) < half.y() - 1e-5
                                : p.head<2>().norm() < half.x() - 1e-5;
        if (across && std::abs(p.z()) < half.z() - 1e-5) return true;
      }
    }
  }
  return false;
}

/// Things overlap when any two of their parts do; a rack's shelves may hold boxes.
bool overlap(const SceneObject& a, const SceneObject& b) {
  if (meshes_reach_into(a, b) || meshes_reach_into(b, a)) return true;
  const auto boxes = [](const SceneObject& object) {
    std::vector<OrientedBox> out;
    for (const ScenePart& part : object.parts) {
      SceneObject alone;
      alone.T_W_O = object.T_W_O * part.T_O_P;
      alone.parts = {part};
      alone.parts[0].T_O_P = Pose::Identity();
      out.push_back(bounding_box(alone));
    }
    return out;
  };
  const std::vector<OrientedBox> boxes_a = boxes(a), boxes_b = boxes(b);
  for (std::size_t i = 0; i < boxes_a.size(); ++i) {
    for (std::size_t k = 0; k < boxes_b.size(); ++k) {
      const bool mesh_a = a.parts[i].shape == Shape::kMesh;
      if (mesh_a != (b.parts[k].shape == Shape::kMesh)) continue;
      if (boxes_overlap(boxes_a[i], boxes_b[k], mesh_a ? 1e-5 : 1e-6)) return true;
    }
  }
  return false;
}

class Shipped : public testing::TestWithParam<fs::path> {};

TEST_P(Shipped, NothingOverlapsInAnyVisit) {
  const Scenario scenario = load_scenario(GetParam());
  for (std::size_t visit = 0; visit < scenario.visits.size(); ++visit) {
    for (const double time_s : {-1.0, 1e9}) {  // transient things are not there yet or no more
      const Scene scene = scene_at(scenario, visit, time_s);
      for (std::size_t i = 0; i < scene.objects.size(); ++i) {
        for (std::size_t k = i + 1; k < scene.objects.size(); ++k) {
          if (scene.objects[i].fixture && scene.objects[k].fixture) continue;
          EXPECT_FALSE(overlap(scene.objects[i], scene.objects[k]))
              << scene.objects[i].name << " and " << scene.objects[k].name << " in visit " << visit;
        }
      }
    }
  }
}

TEST_P(Shipped, RobotsKeepClearOfThings) {
  const Scenario scenario = load_scenario(GetParam());
  for (const SimRobot& robot : scenario.robots) {
    const RobotPath path(robot.path, "test");
    for (std::size_t visit = 0; visit < scenario.visits.size(); ++visit) {
      const std::vector<TruthObject> objects = objects_after(scenario, visit);
      for (double t = 0.0; t < path.duration_s(); t += 0.25) {
        OrientedBox body;  // as small as a robot with this camera mount can be
        body.size_m = {0.6, 0.4, 0.1};
        const Pose T_W_B = path.base_at(t);
        body.pose.position_W = T_W_B.translation() + Eigen::Vector3d(0, 0, scenario.base_height_m);
        body.pose.yaw_rad = std::atan2(T_W_B.linear()(1, 0), T_W_B.linear()(0, 0));
        for (const TruthObject& object : objects) {
          EXPECT_FALSE(boxes_overlap(body, object.box)) << object.name << " at " << t << " s";
        }
      }
    }
  }
}

TEST_P(Shipped, EveryChangeIsInSight) {
  const Scenario scenario = load_scenario(GetParam());
  for (std::size_t visit = 1; visit < scenario.visits.size(); ++visit) {
    VisibleSurfaceOptions options;
    options.voxel_size_m = 0.1;
    options.frame_stride = 8;
    options.include_fixtures = false;
    const auto in_sight = [&](std::size_t when) {
      const Scene scene = scene_at(scenario, when, 1e9);
      std::map<std::string, int> count;
      for (const SurfaceVoxel& voxel : visible_surface(scenario, when, options)) {
        ++count[scene.objects.at(voxel.object).name];
      }
      return count;
    };
    std::map<std::string, int> before = in_sight(visit - 1), after = in_sight(visit);
    for (const TruthChange& change : changes_of(scenario, visit)) {
      // The one scene about a move that nobody can see.
      if (scenario.name == "hidden_move" && change.name == "carton") continue;
      // Five voxels of 10 cm: a toy car's worth of surface. What drove into its place gives none.
      const bool drove = [&] {
        for (const SceneObject& object : scenario.visits[visit].objects) {
          if (object.name == change.name) return !object.track.empty();
        }
        return false;
      }();
      if (change.before && !drove) {
        EXPECT_GE(before[change.name], 5) << change.name << " visit " << visit;
      }
      if (change.after && !drove) {
        EXPECT_GE(after[change.name], 5) << change.name << " visit " << visit;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Shipped, testing::ValuesIn(shipped()), [](const auto& info) {
  std::string name =
      info.param.parent_path().filename().string() + "_" + info.param.stem().string();
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(ThingsScenarios, EachHasAStillTwin) {
  const fs::path folder = fs::path(POCD_SOURCE_DIR) / "config/sim/things";
  int scenes = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() != ".yaml" || name == "stage") continue;
    const Scenario scenario = load_scenario(entry.path());
    ASSERT_EQ(scenario.visits.size(), 2u) << name;
    EXPECT_GT(scenario.sensor.flying_px, 0.0) << name;
    if (name.find("_still") != std::string::npos) {
      EXPECT_TRUE(changes_of(scenario, 1).empty()) << name;
      continue;
    }
    ++scenes;
    const auto changes = changes_of(scenario, 1);
    for (const ChangeKind kind : {ChangeKind::kAdded, ChangeKind::kRemoved, ChangeKind::kMoved}) {
      EXPECT_TRUE(std::any_of(changes.begin(), changes.end(),
                              [&](const TruthChange& change) { return change.kind == kind; }))
          << name << " " << to_string(kind);
    }
    const Scenario still = load_scenario(folder / (name + "_still.yaml"));
    EXPECT_EQ(objects_after(still, 0).size(), objects_after(scenario, 1).size()) << name;
  }
  EXPECT_GE(scenes, 4);
}

TEST(TorwicScenarios, ChangeWhatTheirDescriptionsSay) {
  struct Expected {
    const char* name;
    std::size_t moved, removed, added;
    double largest_step_m;
  };
  // From the circuit's text: 12 outer and 4 inner stacks, 4 fences.
  const Expected table[] = {{"0", 0, 0, 0, 0.0},    {"1-1", 3, 0, 0, 0.3},  {"1-2", 3, 0, 0, 0.6},
                            {"1-3", 3, 0, 0, 0.4},  {"1-4", 12, 0, 0, 0.4}, {"1-5", 16, 0, 0, 0.0},
                            {"1-6", 4, 0, 0, 0.3},  {"1-7", 16, 0, 0, 0.3}, {"1-8", 12, 0, 0, 0.35},
                            {"1-9", 12, 0, 0, 0.6}, {"2-1", 0, 3, 0, 0.0},  {"2-2", 0, 8, 0, 0.0},
                            {"2-3", 0, 16, 0, 0.0}, {"2-4", 0, 4, 0, 0.0},  {"3-1", 5, 0, 0, 0.4},
                            {"3-2", 11, 0, 0, 0.4}, {"3-3", 4, 0, 0, 0.5},  {"4-1", 0, 0, 8, 0.0}};
  EXPECT_EQ(std::size(table), 18u);
  for (const Expected& expected : table) {
    const Scenario run = load_run({torwic("0"), torwic(expected.name)});
    std::size_t moved = 0, removed = 0, added = 0;
    double step_m = 0.0;
    for (const TruthChange& change : changes_of(run, 1)) {
      moved += change.kind == ChangeKind::kMoved;
      removed += change.kind == ChangeKind::kRemoved;
      added += change.kind == ChangeKind::kAdded;
      if (change.kind != ChangeKind::kMoved) continue;
      step_m =
          std::max(step_m, (change.after->pose.position_W - change.before->pose.position_W).norm());
    }
    EXPECT_EQ(moved, expected.moved) << expected.name;
    EXPECT_EQ(removed, expected.removed) << expected.name;
    EXPECT_EQ(added, expected.added) << expected.name;
    EXPECT_NEAR(step_m, expected.largest_step_m, 1e-9) << expected.name;
    EXPECT_FALSE(run.description.empty());
  }
}

TEST(TorwicScenarios, BaselineIsTheCircuit) {
  const Scenario scenario = load_scenario(torwic("0"));
  EXPECT_EQ(scenario.camera, torwic_camera());
  int stacks = 0, fences = 0;
  for (const TruthObject& object : objects_after(scenario, 0)) {
    const Eigen::Vector3d size = object.box.size_m;
    if (object.class_id == 7) {
      ++stacks;
      EXPECT_EQ(object.stationarity_class, 0);
      EXPECT_NEAR(std::remainder(size.x(), 0.5), 0.0, 1e-9);
      EXPECT_GE(size.x(), 1.0 - 1e-9);  // 2 to 4 columns
      EXPECT_LE(size.x(), 2.0 + 1e-9);
      EXPECT_NEAR(size.y(), 0.5, 1e-9);
      EXPECT_NEAR(size.z(), 2.0, 1e-9);
      // Faces 0.7 m from the path, which runs 2.5 m from the middle.
      const double ring = object.box.pose.position_W.head<2>().cwiseAbs().maxCoeff();
      EXPECT_TRUE(std::abs(ring - 3.45) < 1e-9 || std::abs(ring - 1.55) < 1e-9) << object.name;
    } else {
      ++fences;
      EXPECT_EQ(object.class_id, 4);
      EXPECT_EQ(object.stationarity_class, 1);
      EXPECT_NEAR(size.x(), 3.0, 1e-9);
    }
  }
  EXPECT_EQ(stacks, 16);
  EXPECT_EQ(fences, 4);
}

}  // namespace
}  // namespace pocd
