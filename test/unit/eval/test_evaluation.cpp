// Whole runs of the examiner on a small simulated place.
#include "pocd/eval/evaluation.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pocd/config/config_io.hpp"
#include "pocd/eval/published_method.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {
namespace {

const std::filesystem::path kSource = POCD_SOURCE_DIR;

PipelineConfig simulated_config() {
  PipelineConfig config;
  load_config(config, {kSource / "config/simulated.yaml"});
  return config;
}

/// Two visits of a hall with one robot: drives past three stacks; `changed` takes the middle one
/// away.
Scenario hall(bool changed) {
  Scenario scenario = load_scenario(kSource / "config/sim/torwic/0.yaml");
  scenario.robots[0].path.waypoints_m = {{-2.3, -2.5}, {0.3, -2.5}};
  scenario.frame_rate_hz = 10.0;
  scenario.robots[0].path.closed = false;
  scenario.robots[0].path.start_m = 0.0;
  scenario.robots[0].path.corner_radius_m = 0.0;
  SimVisit second = scenario.visits[0];
  if (changed) {
    second.objects.erase(
        std::remove_if(second.objects.begin(), second.objects.end(),
                       [](const SceneObject& o) { return o.name == "bottom_out_2"; }),
        second.objects.end());
  }
  scenario.visits.push_back(second);
  return scenario;
}

RunScore evaluate(const Scenario& scenario, const std::vector<MethodSpec>& methods,
                  std::uint64_t seed) {
  EvaluationInput input;
  input.route = "hall";
  input.seed = seed;
  auto truth = std::make_shared<SceneTruth>(scene_truth(scenario, SceneTruthOptions(), nullptr));
  input.visit_begin.assign(truth->visit_begin.begin(), truth->visit_begin.end() - 1);
  input.truth = truth;
  SimReaderOptions options;
  options.seed = seed;
  options.with_color = false;
  input.reader = std::make_unique<SimReader>(scenario, options);
  return evaluate_run(std::move(input), methods, VoxelMetricsConfig(), 3.0);
}

std::vector<MethodSpec> all_methods(const PipelineConfig& config) {
  return {{"pocd", [=] { return make_pocd_method(config); }},
          {"static_tsdf", [=] { return make_static_tsdf_method(config); }},
          {"tracked_objects", [=] { return make_tracked_objects_method(config); }},
          {"tracked_objects_keep",
           [=] {
             TrackedObjectsConfig keep;
             keep.keep_lost = true;
             return make_tracked_objects_method(config, keep);
           }},
          {"voxel_correction", [=] { return make_voxel_correction_method(config); }},
          {"submaps", [=] { return make_submap_method(config); }},
          {"published", [=] { return make_published_method(config); }}};
}

TEST(Evaluation, ARemovedStackIsForgottenByUsAndKeptByAStaticMap) {
  const RunScore run = evaluate(hall(true), all_methods(simulated_config()), 1);
  const MethodScore& ours = run.methods[0];
  const MethodScore& fixed = run.methods[1];
  EXPECT_GT(ours.by_truth->precision(), fixed.by_truth->precision() + 5.0);
  EXPECT_GT(ours.by_truth->recall(), 90.0);
  ASSERT_TRUE(ours.objects);
  EXPECT_DOUBLE_EQ(ours.objects->recall(ChangeKind::kRemoved), 1.0);
  EXPECT_EQ(ours.objects->false_changes, 0u);
  EXPECT_FALSE(fixed.objects);
  for (const MethodScore& method : run.methods) {
    // Every method maps a static hall well; only given-up objects may be missing.
    EXPECT_GT(method.by_truth->recall(), method.method == "tracked_objects" ? 20.0 : 85.0)
        << method.method;
    EXPECT_GT(method.cpu_ms_per_frame, 0.0) << method.method;
  }
}

TEST(Evaluation, NothingIsRemovedOrMovedWhereNothingChanges) {
  const PipelineConfig config = simulated_config();
  const RunScore run =
      evaluate(hall(false), {{"pocd", [=] { return make_pocd_method(config); }}}, 2);
  EXPECT_EQ(run.methods[0].removed_or_moved, 0u);
  EXPECT_TRUE(run.methods[0].objects->changes.empty());
  EXPECT_GT(run.methods[0].by_truth->precision(), 97.0);
}

// Shifts across, along and away from the view; a move behind something that leaves later. A shift
// of 10 cm is told as REMOVED and ADDED, the carton's move along itself behind the screen as ADDED
// only: neither is told as something that did not happen.
TEST(Evaluation, ShiftsAndMovesBehindAScreenAreToldWithoutFalseChanges) {
  const PipelineConfig config = simulated_config();
  for (const char* name : {"shifted.yaml", "hidden_move.yaml"}) {
    const RunScore run = evaluate(load_run({kSource / "config/sim" / name}),
                                  {{"pocd", [=] { return make_pocd_method(config); }}}, 1);
    const ObjectScore& score = *run.methods[0].objects;
    EXPECT_EQ(score.changes.size(), 3u) << name;
    EXPECT_GE(score.f1(), 0.55) << name;
    EXPECT_EQ(score.false_changes, 0u) << name;
  }
}

// Sixteen walls turn in place by 0.28 rad: old and new surface cross, and the far end is seen
// through while the camera leaves. That takes nothing of what was measured on the way.
TEST(Evaluation, WallsThatTurnInPlaceAreInTheMapWhereTheyAreNow) {
  const PipelineConfig config = simulated_config();
  const std::filesystem::path scenes = kSource / "config/sim/torwic";
  const RunScore run = evaluate(load_run({scenes / "0.yaml", scenes / "1-5.yaml"}),
                                {{"pocd", [=] { return make_pocd_method(config); }}}, 2);
  EXPECT_GT(run.methods[0].by_truth->recall(), 91.0);
  EXPECT_GT(run.methods[0].by_truth->precision(), 99.0);
  EXPECT_GT(run.methods[0].objects->f1(), 0.88);
  EXPECT_EQ(run.methods[0].objects->false_changes, 0u);
}

TEST(Evaluation, WithoutTruthOnlyTheReferenceIsThere) {
  const PipelineConfig config = simulated_config();
  const Scenario scenario = hall(true);
  EvaluationInput input;
  input.route = "recording";
  input.visit_begin = {0, SimSchedule(scenario).frames().size() / 2};
  SimReaderOptions options;
  options.with_color = false;
  input.reader = std::make_unique<SimReader>(scenario, options);
  const RunScore run =
      evaluate_run(std::move(input), {{"fixed", [=] { return make_static_tsdf_method(config); }}},
                   VoxelMetricsConfig(), 3.0);
  EXPECT_FALSE(run.methods[0].by_truth);
  EXPECT_GT(run.methods[0].by_reference.recall(), 80.0);
  EXPECT_LT(run.methods[0].by_reference.precision(), 97.0) << "it still holds what was taken away";
}

TEST(Evaluation, RunsRepeatExactly) {
  const PipelineConfig config = simulated_config();
  const RunScore a = evaluate(hall(true), all_methods(config), 3),
                 b = evaluate(hall(true), all_methods(config), 3);
  for (std::size_t m = 0; m < a.methods.size(); ++m) {
    EXPECT_EQ(a.methods[m].by_truth->voxels, b.methods[m].by_truth->voxels) << a.methods[m].method;
    EXPECT_EQ(a.methods[m].by_reference.voxels, b.methods[m].by_reference.voxels)
        << a.methods[m].method;
  }
}

}  // namespace
}  // namespace pocd
