// Every published transition of a belief can be recomputed from its evidence alone.
#include <gtest/gtest.h>

#include <map>

#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "pocd/state/bayesian_update.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

/// The step as docs/method.md states it, without the life cycle's own code.
Belief step(const Evidence& e, const StateConfig& state, const ChangeConfig& change) {
  const Measurement z{e.delta_m, e.stationarity_class, e.measurement_sigma_m, e.k};
  Belief after = bayesian_update(e.before, z, change.delta_max_m).belief;
  if (after.alpha / (after.alpha + after.beta) > state.max_stationarity) return e.before;
  const double scale = std::min(1.0, state.max_count / (after.alpha + after.beta));
  after.alpha *= scale;
  after.beta *= scale;
  after.sigma = std::max(after.sigma, state.min_sigma_share * e.measurement_sigma_m);
  return after;
}

/// Drive of two visits through the hall, at half the resolution and half the rate, between which
/// three things shift.
std::vector<ObjectEvent> events_of_a_drive(const PipelineConfig& config) {
  Scenario scenario =
      load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/shifted.yaml");
  CameraModel& camera = scenario.camera;
  camera = {camera.width / 2, camera.height / 2, camera.fx / 2,
            camera.fy / 2,    camera.cx / 2,     camera.cy / 2};
  scenario.frame_rate_hz /= 2;
  SimReaderOptions options;
  options.with_color = false;
  SimReader reader(scenario, options);
  PocdPipeline pipeline(config);
  std::vector<ObjectEvent> events;
  while (const auto frame = reader.next()) {
    const FrameResult result = pipeline.process_frame(*frame);
    events.insert(events.end(), result.events.begin(), result.events.end());
  }
  return events;
}

TEST(Evidence, GivesTheBeliefAfterItOverAWholeRun) {
  PipelineConfig config;
  config.classes = test::room_classes();
  config.segmentation.stride = 1;
  const std::vector<ObjectEvent> events = events_of_a_drive(config);
  std::map<EventKind, int> recomputed;
  for (const ObjectEvent& e : events) {
    const Evidence& evidence = e.evidence;
    if (evidence.measurement_sigma_m <= 0.0) {
      EXPECT_EQ(evidence.after.alpha, evidence.before.alpha) << "no measurement, no step";
      continue;
    }
    const Belief after = step(evidence, config.state, config.change);
    EXPECT_NEAR(after.mu, evidence.after.mu, 1e-12) << e.sequence;
    EXPECT_NEAR(after.sigma, evidence.after.sigma, 1e-12) << e.sequence;
    EXPECT_NEAR(after.alpha, evidence.after.alpha, 1e-12) << e.sequence;
    EXPECT_NEAR(after.beta, evidence.after.beta, 1e-12) << e.sequence;
    EXPECT_NEAR(evidence.c1 + evidence.c2, 1.0, 1e-12);
    EXPECT_FALSE(evidence.rule.empty());
    // And the weight k by the rule.
    const Measurement z{evidence.delta_m, evidence.stationarity_class, evidence.measurement_sigma_m,
                        0.0};
    EXPECT_EQ(evidence.k,
              adaptive_k(evidence.before, z, config.change.delta_max_m, config.state.k));
    ++recomputed[e.kind];
  }
  // The run must have shown what it is about: additions, and things that went or moved.
  EXPECT_GE(recomputed[EventKind::kAdded], 4);
  EXPECT_GE(recomputed[EventKind::kRemoved] + recomputed[EventKind::kMoved], 2);
}

}  // namespace
}  // namespace pocd
