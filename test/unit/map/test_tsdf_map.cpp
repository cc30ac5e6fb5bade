#include <gtest/gtest.h>

#include <thread>

#include "map_fixtures.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/mesh.hpp"

namespace pocd::testing {
namespace {

// A wall seen head on: the projective distance is the true one, so only the 16-bit storage is off:
// one step is 0.2 m / 32767 = 6 micrometres, and the average rounds once per frame.
TEST(TsdfMap, WallSeenHeadOnIsExact) {
  TsdfMap map(coarse_config());
  ThreadPool pool(1);
  for (int i = 0; i < 5; ++i) {
    map.integrate(look({2.51, {}}, camera_pose({0.01 * i, 0, 1}, 0, 0)).input(), pool);
  }
  int checked = 0;
  for (const BlockKey& key : map.sorted_keys()) {
    const VoxelBlock& block = *map.find(key);
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      if (block.weight[v] == 0) continue;
      const double expected = std::min(0.2, 2.51 - voxel_center(key, v, 0.05).y());
      EXPECT_NEAR(block.tsdf[v] * 0.2 / 32767, expected, 5e-5);
      ++checked;
    }
  }
  EXPECT_GT(checked, 10000);
}

// A sphere seen from an arc: the projective distance overestimates by 1 / cos of the angle between
// ray and normal, which moves no zero crossing; what remains is linear interpolation over a voxel
// (h^2 / 8 r = 0.1 mm at 2 cm) and nearest pixels (half a pixel = 5 mm at 1.5 m, times the slope).
TEST(TsdfMap, SphereSurfaceIsAccurate) {
  TsdfConfig config = coarse_config();
  config.voxel_size_m = 0.02;
  TsdfMap map(config);
  ThreadPool pool(2);
  const Sphere sphere{{0.0, 1.5, 1.0}, 0.35, 4};
  for (const Pose& pose : arc_of_poses(40, 5)) {
    map.integrate(look({2.5, {sphere}}, pose).input(), pool);
  }
  const Mesh mesh = extract_mesh(map, 5, pool);
  double sum = 0.0, worst = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < mesh.vertices_W.size(); ++i) {
    const Eigen::Vector3d p = mesh.vertices_W[i].cast<double>();
    // The front cap; towards the outline rays graze the surface.
    if (mesh.owner[i] != 4 || (p - sphere.center_W).normalized().y() > -0.5) continue;
    const double error = std::abs((p - sphere.center_W).norm() - sphere.radius_m);
    sum += error;
    worst = std::max(worst, error);
    ++count;
  }
  ASSERT_GT(count, 500);
  EXPECT_LT(sum / count, 0.002);
  EXPECT_LT(worst, 0.01);
}

TEST(TsdfMap, ThreadCountDoesNotChangeABit) {
  std::vector<TsdfMap> maps;
  for (const int threads : {1, 2, 3}) {
    ThreadPool pool(threads);
    TsdfMap map(coarse_config());
    int frame = 0;
    for (const Pose& pose : arc_of_poses(12, 11)) {
      const double x = frame++ < 6 ? -0.4 : 0.4;
      map.integrate(look({2.5, {{{x, 1.5, 1.0}, 0.3, 2}}}, pose).input(), pool);
    }
    maps.push_back(std::move(map));
  }
  EXPECT_TRUE(same_map(maps[0], maps[1]));
  EXPECT_TRUE(same_map(maps[0], maps[2]));
  EXPECT_EQ(maps[0].take_dirty(), maps[1].take_dirty());
}

TEST(TsdfMap, PixelsToSkipAreNeitherMappedNorCarved) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  View view = look({2.5, {}}, camera_pose({0, 0, 1}, 0, 0));
  const auto all = view.owners;
  view.owners.assign(all.size(), IntegrationInput::kSkip);
  map.integrate(view.input(), pool);
  EXPECT_EQ(map.block_count(), 0u);

  view.owners = all;
  map.integrate(view.input(), pool);
  const std::size_t wall = map.block_count();
  ASSERT_GT(wall, 0u);
  View beyond = look({3.5, {}}, view.frame.T_W_C);
  beyond.owners.assign(all.size(), IntegrationInput::kSkip);
  for (int i = 0; i < 20; ++i) map.integrate(beyond.input(), pool);
  EXPECT_EQ(map.block_count(), wall);
}

TEST(TsdfMap, DepthBeyondTheLimitIsNotUsed) {
  TsdfConfig config = coarse_config();
  config.max_depth_m = 2.0;
  TsdfMap map(config);
  ThreadPool pool(1);
  map.integrate(look({2.5, {}}, camera_pose({0, 0, 1}, 0, 0)).input(), pool);
  EXPECT_EQ(map.block_count(), 0u);
}

TEST(TsdfMap, DepthBeyondTheLimitClearsWhatIsBeforeIt) {
  ThreadPool pool(1);
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  for (const bool clear : {false, true}) {
    TsdfConfig config = coarse_config();
    config.max_depth_m = 2.0;
    config.clear_beyond_limit = clear;
    TsdfMap map(config);
    for (int i = 0; i < 10; ++i) map.integrate(look({1.5, {}}, pose).input(), pool);
    ASSERT_FALSE(extract_mesh(map, 2, pool).triangles.empty());
    for (int i = 0; i < 100; ++i) map.integrate(look({2.5, {}}, pose).input(), pool);
    EXPECT_EQ(extract_mesh(map, 2, pool).triangles.empty(), clear);
  }
}

TEST(TsdfMap, ImagesWithGapsBetweenRowsAndWithoutOwnersAreRead) {
  ThreadPool pool(1);
  const View view = look({2.5, {}}, camera_pose({0, 0, 1}, 0.1, 0.1));
  cv::Mat wide(120, 200, CV_32FC1, cv::Scalar(1.0));
  view.frame.depth_m.copyTo(wide(cv::Rect(20, 0, 160, 120)));
  Frame frame = view.frame;
  frame.depth_m = wide(cv::Rect(20, 0, 160, 120));
  TsdfMap a(coarse_config()), b(coarse_config());
  a.integrate(view.input(), pool);
  b.integrate({&frame, nullptr, 0, 0, 1}, pool);
  EXPECT_TRUE(same_map(a, b));
}

TEST(TsdfMap, DirtyBlocksAreThoseThatChanged) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  const View view = look({2.5, {}}, camera_pose({0, 0, 1}, 0, 0));
  map.integrate(view.input(), pool);
  EXPECT_EQ(map.take_dirty(), map.sorted_keys());
  EXPECT_TRUE(map.take_dirty().empty());
  for (int i = 0; i < 200; ++i) map.integrate(view.input(), pool);
  map.take_dirty();
  // Weights are at their cap and the distances do not move: nothing changes any more.
  map.integrate(view.input(), pool);
  EXPECT_TRUE(map.take_dirty().empty());
}

TEST(TsdfMap, ListOfDirtyBlocksIsBoundedThoughNobodyTakesIt) {
  TsdfMap map(coarse_config());
  // Eight blocks come and go, as those of free space do around something that moves.
  for (int i = 0; i < 200'000; ++i) {
    VoxelBlock& block = map.touch({i % 8, 0, 0});
    block.owner[0] = 5, block.weight[0] = 3;
    map.clear_object(ObjectId{5});
  }
  EXPECT_EQ(map.block_count(), 0u);
  EXPECT_LT(map.memory_status().memory_bytes, 1u << 20);
  EXPECT_EQ(map.take_dirty().size(), 8u);
  EXPECT_TRUE(map.take_dirty().empty());
}

TEST(TsdfMap, ReadersBesideEachOtherAreAllCounted) {
  TsdfMap map(coarse_config());
  map.touch({0, 0, 0});  // one block: the shorter a call, the more of them meet
  const TsdfMap& read = map;
  const MapVisits before = read.visits();
  constexpr int kThreads = 4, kReads = 200'000;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&read] {
      for (int i = 0; i < kReads; ++i) read.sorted_keys();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(read.visits().blocks - before.blocks, 1u * kThreads * kReads);
}

TEST(TsdfMap, ImpossibleSettingsAreRejected) {
  TsdfConfig config;
  config.voxel_size_m = 0.0;
  EXPECT_THROW(TsdfMap{config}, InputError);
  config = TsdfConfig{};
  config.voxel_size_m = 0.002;
  config.max_depth_m = 100.0;
  TsdfMap map(config);
  ThreadPool pool(1);
  EXPECT_THROW(map.integrate(look({2.5, {}}, camera_pose({0, 0, 1}, 0, 0)).input(), pool),
               InputError);
  EXPECT_THROW(TsdfMap(coarse_config())
                   .integrate(look({2.5, {}}, camera_pose({1e12, 0, 1}, 0, 0)).input(), pool),
               InputError);
}

}  // namespace
}  // namespace pocd::testing
