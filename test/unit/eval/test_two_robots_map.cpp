// Two robots on overlapping routes give the map that one robot gives which drives both routes.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "pocd/config/config_io.hpp"
#include "pocd/eval/mapping_method.hpp"
#include "pocd/eval/voxel_metrics.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {
namespace {

constexpr double kVoxel_m = 0.1;
/// Long enough to get from the end of one route to the beginning of the other.
constexpr StampNs kBetween_ns = 30'000'000'000;

/// The loop of the scenario, driven whole by both robots, half a loop apart.
Scenario two_on_a_loop() {
  Scenario scenario =
      load_scenario(std::string(POCD_SOURCE_DIR) + "/test/integration/data/two_drives.yaml");
  scenario.frame_rate_hz = 5.0;
  scenario.camera = {320, 180, 230.0, 230.0, 159.5, 89.5};
  scenario.sensor = SensorModel();  // stereo
  scenario.robots.push_back(scenario.robots[0]);
  scenario.robots[1].name = "robot2";
  scenario.robots[1].path.start_m = 4.4;
  return scenario;
}

struct Outcome {
  std::set<VoxelIndex> surface;
  std::vector<ObjectSnapshot> objects;
  std::size_t removed = 0;
  std::size_t refused = 0;
};

/// `one_robot`: the same frames as if one robot drove the second route after the first.
Outcome map_of(const Scenario& scenario, std::uint64_t seed, bool one_robot) {
  SimReaderOptions options;
  options.seed = seed;
  options.with_color = false;
  const SimReader reader(scenario, options);
  const auto& schedule = reader.schedule().frames();
  std::vector<std::size_t> order(schedule.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  if (one_robot) {
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(schedule[a].visit, schedule[a].robot) <
             std::pair(schedule[b].visit, schedule[b].robot);
    });
  }
  PipelineConfig config;
  load_config(config, {std::string(POCD_SOURCE_DIR) + "/config/simulated.yaml"});
  const auto method = make_pocd_method(config);
  Outcome outcome;
  StampNs shift_ns = 0, last_ns = 0;
  for (std::size_t n = 0; n < order.size(); ++n) {
    Frame frame = reader.frame(order[n]);
    const auto& when = schedule[order[n]];
    if (one_robot) {
      frame.robot = "robot";
      const bool next_route = n > 0 && when.robot != schedule[order[n - 1]].robot;
      if (next_route) shift_ns = last_ns + kBetween_ns - frame.stamp_ns;
      frame.stamp_ns += shift_ns;
      last_ns = frame.stamp_ns;
    }
    const FrameResult result = method->process(frame);
    outcome.refused += !result.accepted;
    for (const ObjectEvent& event : result.events) {
      outcome.removed += event.kind == EventKind::kRemoved;
    }
  }
  VoxelMetricsConfig voxels;
  voxels.voxel_size_m = kVoxel_m;
  for (const auto& [voxel, points] : occupied_voxels(method->surface(), voxels)) {
    outcome.surface.insert(voxel);
  }
  outcome.objects = method->objects();
  return outcome;
}

/// Share of the voxels of either map that the other does not have.
double difference(const Outcome& a, const Outcome& b) {
  std::vector<VoxelIndex> either, one;
  std::set_union(a.surface.begin(), a.surface.end(), b.surface.begin(), b.surface.end(),
                 std::back_inserter(either));
  std::set_symmetric_difference(a.surface.begin(), a.surface.end(), b.surface.begin(),
                                b.surface.end(), std::back_inserter(one));
  return static_cast<double>(one.size()) / static_cast<double>(either.size());
}

// The bound is the difference that sensor noise alone makes between two drives of one robot: the
// number of robots must not matter more than the seed of the noise.
TEST(TwoRobotsMap, EqualsTheMapOfOneRobotThatDrivesBothRoutes) {
  const Scenario scenario = two_on_a_loop();
  const Outcome two = map_of(scenario, 1, false);
  const Outcome one = map_of(scenario, 1, true);
  const double noise = difference(one, map_of(scenario, 2, true));
  const double measured = difference(two, one);
  std::cout << "two robots against one: " << 100.0 * measured << " % of " << one.surface.size()
            << " voxels differ; two seeds of one robot: " << 100.0 * noise << " %\n";
  ASSERT_GT(one.surface.size(), 500u);
  EXPECT_LE(measured, noise);

  EXPECT_EQ(two.refused, one.refused) << "the path turns on the spot at its end";
  EXPECT_EQ(two.removed, 1u);
  EXPECT_EQ(one.removed, 1u);
  ASSERT_EQ(two.objects.size(), one.objects.size());
  for (const ObjectSnapshot& object : two.objects) {
    EXPECT_EQ(object.seen_by, (std::vector<std::string>{"robot1", "robot2"}));
    const auto near = std::find_if(one.objects.begin(), one.objects.end(), [&](const auto& other) {
      // A voxel of the map.
      return (other.box.pose.position_W - object.box.pose.position_W).norm() < 0.05;
    });
    EXPECT_NE(near, one.objects.end()) << object.box.pose.position_W.transpose();
  }
}

}  // namespace
}  // namespace pocd
