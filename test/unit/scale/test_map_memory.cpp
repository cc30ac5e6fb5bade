// A map with a memory budget is the map without one, bit by bit.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "map_fixtures.hpp"
#include "pocd/map/map_io.hpp"
#include "pocd/map/map_reader.hpp"
#include "pocd/map/mesh.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "scratch_folder.hpp"
#include "test_room.hpp"

namespace pocd::testing {
namespace {

TsdfConfig limited(const TsdfConfig& config, const ScratchFolder& folder, int budget_mb) {
  TsdfConfig result = config;
  result.memory.limit = MapLimit::kBudget;
  result.memory.budget_mb = budget_mb;
  result.memory.folder = folder.path().string();
  return result;
}

/// Along a wall of 48 m with a ball every 6 m, and back. Steps of 0.8 m.
std::vector<View> make_views() {
  std::vector<View> views;
  for (int i = 0; i <= 120; ++i) {
    const double x = 0.8 * (i <= 60 ? i : 120 - i);
    Scene scene;
    for (int k = 0; k <= 8; ++k) {
      scene.spheres.push_back({{6.0 * k, 1.6, 1.0}, 0.3, static_cast<std::uint32_t>(k + 1)});
    }
    views.push_back(look(scene, camera_pose({x, 0.0, 1.0}, 0.0, 0.0)));
  }
  return views;
}

const std::vector<View>& there_and_back() {
  static const std::vector<View> views = make_views();
  return views;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class LimitedMap : public ::testing::Test {
 protected:
  void drive() {
    ThreadPool pool(2);
    for (const View& view : there_and_back()) {
      free_.integrate(view.input(), pool);
      small_.integrate(view.input(), pool);
      const MapMemoryStatus now = small_.memory_status();
      EXPECT_LE(now.memory_bytes, now.budget_bytes);
      EXPECT_EQ(now.blocks_in_memory + now.blocks_on_disk, small_.block_count());
    }
  }
  std::string saved(const TsdfMap& map) {
    save_map(map, folder_ / "map");
    return bytes_of(folder_ / "map");
  }

  ScratchFolder folder_;
  TsdfMap free_{coarse_config()};
  TsdfMap small_{limited(coarse_config(), folder_, 3)};
};

TEST_F(LimitedMap, IsTheSameMapAtEveryStep) {
  ThreadPool pool(1);
  MapPublisher whole(1, free_.config()), part(1, small_.config());
  for (const View& view : there_and_back()) {
    free_.integrate(view.input(), pool);
    small_.integrate(view.input(), pool);
    whole.update(free_);
    part.update(small_);
    ASSERT_EQ(whole.digest(), part.digest());
    ASSERT_EQ(whole.version(), part.version());
  }
  const MapMemoryStatus status = small_.memory_status();
  EXPECT_GT(free_.memory_status().memory_bytes, 2 * status.budget_bytes);
  EXPECT_GT(status.evictions, 0u);
  EXPECT_GT(status.returns, 0u);
  EXPECT_GT(status.blocks_on_disk, 0u);
  EXPECT_GT(status.disk_bytes, 0u);
  EXPECT_EQ(status.frames_over_budget, 0u);
  EXPECT_EQ(status.blocks_lost + status.write_failures, 0u);
  EXPECT_EQ(free_.memory_status().evictions, 0u);
}

TEST_F(LimitedMap, WholeMapIsReadFromMemoryAndDisk) {
  drive();
  ThreadPool pool(2);
  const std::uint64_t on_disk = small_.memory_status().blocks_on_disk;
  EXPECT_EQ(free_.sorted_keys(), small_.sorted_keys());
  EXPECT_EQ(saved(free_), saved(small_));
  const Mesh a = extract_mesh(free_, 1, pool), b = extract_mesh(small_, 1, pool);
  EXPECT_GT(a.triangles.size(), 1000u);
  EXPECT_EQ(a.vertices_W, b.vertices_W);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.owner, b.owner);
  // A publication that starts only now: every dirty block, most of them on disk.
  MapPublisher whole(1, free_.config()), part(1, small_.config());
  whole.update(free_);
  part.update(small_);
  EXPECT_EQ(whole.digest(), part.digest());
  EXPECT_EQ(small_.memory_status().blocks_on_disk, on_disk) << "reading moves nothing";
}

TEST_F(LimitedMap, ObjectsOnDiskAreClearedAndRenamed) {
  drive();
  free_.take_dirty();
  small_.take_dirty();
  for (std::uint32_t k = 1; k <= 9; k += 2) {
    const std::size_t cleared = free_.clear_object(ObjectId{k});
    EXPECT_GT(cleared, 0u);
    EXPECT_EQ(cleared, small_.clear_object(ObjectId{k}));
    EXPECT_EQ(free_.reassign_object(ObjectId{k + 1}, ObjectId{77}),
              small_.reassign_object(ObjectId{k + 1}, ObjectId{77}));
  }
  EXPECT_EQ(free_.clear_object(ObjectId{77}), small_.clear_object(ObjectId{77}));
  EXPECT_EQ(free_.take_dirty(), small_.take_dirty());
  EXPECT_EQ(saved(free_), saved(small_));
}

TEST_F(LimitedMap, LoadsAMapLargerThanItself) {
  drive();
  const std::string bytes = saved(free_);
  const TsdfMap loaded = load_map(folder_ / "map", small_.config());
  EXPECT_GT(loaded.memory_status().blocks_on_disk, 0u);
  EXPECT_LE(loaded.memory_status().memory_bytes, loaded.memory_status().budget_bytes);
  EXPECT_EQ(saved(loaded), bytes);
}

TEST_F(LimitedMap, EvictsTheSameEveryTime) {
  drive();
  const MapMemoryStatus first = small_.memory_status();
  small_ = TsdfMap(limited(coarse_config(), folder_, 3));
  free_ = TsdfMap(coarse_config());
  drive();
  const MapMemoryStatus again = small_.memory_status();
  EXPECT_EQ(first.evictions, again.evictions);
  EXPECT_EQ(first.returns, again.returns);
  EXPECT_EQ(first.memory_bytes, again.memory_bytes);
  EXPECT_EQ(first.disk_bytes, again.disk_bytes);
}

TEST_F(LimitedMap, LeavesNoFileBehind) {
  drive();
  EXPECT_GT(small_.memory_status().disk_bytes, 0u);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path())) << "the file has no name";
}

/// Three laps of two robots in the small warehouse, with a small camera at a low rate.
Scenario circuit() {
  Scenario scenario =
      load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/demo.yaml");
  CameraModel& c = scenario.camera;
  c = {c.width / 4, c.height / 4, c.fx / 4, c.fy / 4, c.cx / 4, c.cy / 4};
  scenario.frame_rate_hz = 3.0;
  return scenario;
}

std::string line(const ObjectEvent& e) {
  return std::string(to_string(e.kind)) + " " + std::to_string(to_index(e.object)) + " " +
         std::to_string(e.stamp_ns) + " " + e.evidence.rule + " " +
         std::to_string(e.evidence.delta_m);
}

TEST(LimitedPipeline, MapsACircuitAsAnUnlimitedOneDoes) {
  const ScratchFolder folder;
  PipelineConfig config = test::room_config();
  config.pose_gate.max_speed_mps = 100.0;
  PocdPipeline whole(config);
  config.map = limited(config.map, folder, 4);
  config.threads = 2;
  PocdPipeline part(config);
  MapPublisher published(1, config.map), published_part(1, config.map);
  SimReaderOptions options;
  options.with_color = false;
  SimReader reader(circuit(), options);
  std::size_t events = 0;
  for (int frames = 0; const auto frame = reader.next(); ++frames) {
    const FrameResult a = whole.process_frame(*frame), b = part.process_frame(*frame);
    ASSERT_EQ(a.events.size(), b.events.size());
    for (std::size_t i = 0; i < a.events.size(); ++i) {
      ASSERT_EQ(line(a.events[i]), line(b.events[i]));
    }
    events += a.events.size();
    ASSERT_EQ(a.warnings, b.warnings);
    if (frames % 10 != 0) continue;
    published.update(whole.map());
    published_part.update(part.map());
    ASSERT_EQ(published.digest(), published_part.digest());
  }
  published.update(whole.map());
  published_part.update(part.map());
  EXPECT_EQ(published.digest(), published_part.digest());
  EXPECT_GT(events, 5u);
  const MapMemoryStatus status = part.map().memory_status();
  EXPECT_GT(status.returns, 20u);
  EXPECT_GT(status.blocks_on_disk, 0u);
}

}  // namespace
}  // namespace pocd::testing
