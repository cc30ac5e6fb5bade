// Every published transition of a belief can be recomputed from its evidence alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pocd/belief/bayesian_update.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "pocd/track/rules.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

/// The step as docs/method.md states it, without the life cycle's own code.
Belief step(const Evidence& e, const StateConfig& state, const ChangeConfig& change) {
  const Measurement z{e.delta_m, e.stationarity_class, e.measurement_sigma_m, e.k};
  Belief after = bayesian_update(e.before, z, change.delta_max_m).belief;
  const auto share = [](const Belief& b) { return b.alpha / (b.alpha + b.beta); };
  if (share(after) > std::max(state.max_stationarity, share(e.before)))
    after.alpha = e.before.alpha, after.beta = e.before.beta;
  const double scale = std::min(1.0, state.max_count / (after.alpha + after.beta));
  after.alpha *= scale;
  after.beta *= scale;
  after.sigma = std::max(after.sigma, state.min_sigma_share * e.measurement_sigma_m);
  if (e.rule == "aligned_elsewhere") after.mu = 0.0;  // measured from the new place on
  return after;
}

/// Whether the rule that the event names follows from its evidence.
bool rule_holds(const ObjectEvent& event, const PipelineConfig& config) {
  const Evidence& e = event.evidence;
  if (e.rule == "stationarity_below_threshold")
    return e.after.stationarity() < config.state.remove_below;
  if (e.rule == "aligned_elsewhere") return event.kind == EventKind::kMoved && e.after.mu == 0.0;
  // What is left or taken away of a surface, or who is who, is no matter of the belief.
  const auto rule = rule_of(e.rule);
  if (!rule) return false;
  const auto& told_by = all_rules()[static_cast<std::size_t>(*rule)].events;
  return std::find(told_by.begin(), told_by.end(), event.kind) != told_by.end();
}

/// Drive of two visits through the hall, at half the resolution and half the rate, between which
/// three things shift.
struct Told {
  ObjectEvent event;
  std::optional<Belief> published;  ///< of the object in the same result
};
std::vector<Told> events_of_a_drive(const PipelineConfig& config, const std::string& name) {
  Scenario scenario = load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim" / name);
  CameraModel& camera = scenario.camera;
  camera = {camera.width / 2, camera.height / 2, camera.fx / 2,
            camera.fy / 2,    camera.cx / 2,     camera.cy / 2};
  scenario.frame_rate_hz /= 2;
  SimReaderOptions options;
  options.with_color = false;
  SimReader reader(scenario, options);
  PocdPipeline pipeline(config);
  std::vector<Told> events;
  while (const auto frame = reader.next()) {
    const FrameResult result = pipeline.process_frame(*frame);
    for (const ObjectEvent& event : result.events) {
      EXPECT_EQ(event.stamp_ns, frame->stamp_ns);
      EXPECT_EQ(event.frame_sequence, frame->sequence);
      Told told{event, std::nullopt};
      for (const ObjectSnapshot& object : result.changed_objects) {
        if (object.id == event.object) told.published = object.belief;
      }
      events.push_back(told);
    }
  }
  return events;
}

/// Recomputes every event of a run from itself alone; counts those with a measurement, by kind.
std::map<EventKind, int> recompute(const std::vector<Told>& events, const PipelineConfig& config) {
  std::map<EventKind, int> recomputed;
  for (const Told& told : events) {
    const ObjectEvent& e = told.event;
    const Evidence& evidence = e.evidence;
    EXPECT_TRUE(rule_holds(e, config)) << e.sequence << " " << evidence.rule;
    // What the event says is what the object then has; a move that a removal revealed goes on with
    // the belief of what was found at the new place.
    const bool same_thing = e.kind != EventKind::kMoved || evidence.rule == "aligned_elsewhere";
    if (told.published && same_thing) {
      EXPECT_EQ(evidence.after.mu, told.published->mu) << e.sequence << " " << evidence.rule;
      EXPECT_EQ(evidence.after.sigma, told.published->sigma) << e.sequence;
      EXPECT_EQ(evidence.after.alpha, told.published->alpha) << e.sequence;
      EXPECT_EQ(evidence.after.beta, told.published->beta) << e.sequence;
    }
    if (evidence.measurement_sigma_m <= 0.0) {
      EXPECT_EQ(evidence.after.alpha, evidence.before.alpha) << "no measurement, no step";
      continue;
    }
    const Belief after = step(evidence, config.state, config.change);
    EXPECT_NEAR(after.mu, evidence.after.mu, 1e-12) << e.sequence;
    EXPECT_NEAR(after.sigma, evidence.after.sigma, 1e-12) << e.sequence;
    EXPECT_NEAR(after.alpha, evidence.after.alpha, 1e-12) << e.sequence;
    EXPECT_NEAR(after.beta, evidence.after.beta, 1e-12) << e.sequence;
    // The weight k by its rule, and with it the probabilities of inlier and outlier.
    Measurement z{evidence.delta_m, evidence.stationarity_class, evidence.measurement_sigma_m, 0.0};
    EXPECT_EQ(evidence.k,
              adaptive_k(evidence.before, z, config.change.delta_max_m, config.state.k));
    z.k = evidence.k;
    const UpdateResult update = bayesian_update(evidence.before, z, config.change.delta_max_m);
    EXPECT_NEAR(update.c1, evidence.c1, 1e-12);
    EXPECT_NEAR(update.c2, evidence.c2, 1e-12);
    EXPECT_GE(evidence.visible_share, 0.0);
    EXPECT_LE(evidence.visible_share, 1.0);
    ++recomputed[e.kind];
  }
  return recomputed;
}

PipelineConfig drive_config() {
  PipelineConfig config;
  config.classes = test::room_classes();
  config.segmentation.stride = 1;
  return config;
}

TEST(Evidence, GivesTheBeliefAfterItOverAWholeRun) {
  const PipelineConfig config = drive_config();
  std::map<EventKind, int> all;
  for (const char* name : {"shifted.yaml", "swapped.yaml", "aisle.yaml"}) {
    const std::vector<Told> events = events_of_a_drive(config, name);
    for (const auto& [kind, count] : recompute(events, config)) all[kind] += count;
  }
  // The runs must have shown what they are about: things that came, grew, went and moved.
  EXPECT_GE(all[EventKind::kAdded], 4);
  EXPECT_GE(all[EventKind::kUpdated], 1);
  EXPECT_GE(all[EventKind::kRemoved], 1);
  EXPECT_GE(all[EventKind::kMoved], 1);
}

}  // namespace
}  // namespace pocd
