#include <gtest/gtest.h>

#include "map_fixtures.hpp"
#include "reference_integrator.hpp"

namespace pocd::testing {
namespace {

void expect_equal(const TsdfMap& map, const ReferenceIntegrator& reference) {
  ASSERT_EQ(map.block_count(), reference.blocks().size());
  for (const auto& [key, expected] : reference.blocks()) {
    const VoxelBlock* block = map.find(key);
    ASSERT_NE(block, nullptr) << key.x << " " << key.y << " " << key.z;
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      ASSERT_TRUE(block->tsdf[v] == expected.tsdf[v] && block->weight[v] == expected.weight[v] &&
                  block->owner[v] == expected.owner[v])
          << "voxel " << v << " of " << key.x << " " << key.y << " " << key.z << ": distance "
          << block->tsdf[v] << " for " << expected.tsdf[v] << ", weight " << block->weight[v]
          << " for " << expected.weight[v] << ", owner " << block->owner[v] << " for "
          << expected.owner[v];
    }
  }
}

// Bit for bit, over a scene that changes: a sphere moves, and in some frames pixels are missing or
// not to be integrated. The reference gets the fast version's new blocks, since which blocks exist
// is tested on its own below.
TEST(TsdfReference, EveryVoxelIsEqualBitForBit) {
  for (const double voxel_m : {0.05, 0.02}) {
    TsdfConfig config = coarse_config();
    config.voxel_size_m = voxel_m;
    config.max_weight = 12;
    TsdfMap map(config);
    ReferenceIntegrator reference(config);
    ThreadPool pool(2);
    Random random(7);
    int frame = 0;
    for (const Pose& pose : arc_of_poses(24, 1)) {
      Scene scene{2.5, {{{-0.5, 1.6, 1.0}, 0.3, 3}, {{frame < 12 ? 0.4 : 0.7, 1.4, 0.9}, 0.2, 9}}};
      View view = look(scene, pose);
      for (int n = 0; n < 300; ++n) {
        const int u = static_cast<int>(random.below(160)), v = static_cast<int>(random.below(120));
        if (frame % 2 == 0) view.frame.depth_m.at<float>(v, u) = 0.0f;
        if (frame % 3 == 0) view.owners[v * 160 + u] = IntegrationInput::kSkip;
      }
      map.integrate(view.input(), pool);
      reference.integrate(view.input(), map.sorted_keys());
      expect_equal(map, reference);
      ++frame;
    }
    EXPECT_GT(map.block_count(), 100u);
  }
}

TEST(TsdfReference, OwnersOfASmallerImageAreLookedUpAtTheRightPixel) {
  const TsdfConfig config = coarse_config();
  View view = look({2.5, {}}, camera_pose({0, 0, 1}, 0.2, 0.1));
  for (const int stride : {1, 2, 3, 4, 7}) {
    const int width = (160 + stride - 1) / stride, height = (120 + stride - 1) / stride;
    std::vector<std::uint32_t> owners;
    for (int i = 0; i < width * height; ++i) owners.push_back(static_cast<std::uint32_t>(i % 5));
    const IntegrationInput input{&view.frame, owners.data(), width, height, stride};
    TsdfMap map(config);
    ReferenceIntegrator reference(config);
    ThreadPool pool(1);
    map.integrate(input, pool);
    reference.integrate(input, map.sorted_keys());
    expect_equal(map, reference);
  }
}

// The sampled search must find the blocks that carry surface; 1.75 voxels is what a cell that the
// surface crosses can reach. A block of which fewer pixels see a corner than the search steps over,
// at the image border or an outline, may wait for the next frame: of these scenes' blocks 0.5 % do.
TEST(TsdfReference, BlocksNearTheSurfaceAreFound) {
  for (const double voxel_m : {0.1, 0.05, 0.02}) {
    TsdfConfig config = coarse_config();
    config.voxel_size_m = voxel_m;
    ThreadPool pool(1);
    std::size_t missed = 0, all = 0;
    for (const Pose& pose : arc_of_poses(10, 3)) {
      const Scene scene{2.2, {{{0.1, 1.3, 1.0}, 0.4, 1}, {{-0.6, 0.9, 1.2}, 0.15, 2}}};
      const View view = look(scene, pose);
      TsdfMap map(config);
      map.integrate(view.input(), pool);
      for (const BlockKey& key : blocks_near_surface(config, view.input(), 1.75)) {
        missed += map.find(key) == nullptr;
        ++all;
      }
    }
    EXPECT_LE(missed * 100, all) << "at " << voxel_m;
  }
}

}  // namespace
}  // namespace pocd::testing
