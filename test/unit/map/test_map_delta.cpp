#include "pocd/map/map_delta.hpp"

#include <gtest/gtest.h>

#include "map_fixtures.hpp"

namespace pocd::testing {
namespace {

Scene ball_scene(double x) { return {2.5, {{{x, 1.5, 1.0}, 0.3, 300000}}}; }

TEST(MapPublisher, TilesHoldTheMapWithinTheQuantisation) {
  const TsdfConfig config = coarse_config();
  TsdfMap map(config);
  ThreadPool pool(1);
  for (const Pose& pose : arc_of_poses(8, 4))
    map.integrate(look(ball_scene(0), pose).input(), pool);
  MapPublisher publisher(1, config);
  const auto delta = publisher.update(map);
  ASSERT_TRUE(delta);
  std::size_t observed = 0, owned = 0;
  for (const auto& [key, tile] : publisher.tiles()) {
    const DecodedTile decoded = decode_tile(tile.payload, config.truncation_m());
    for (int i = 0; i < kTileSide * kTileSide * kTileSide; ++i) {
      const int x = i % 16, y = i / 16 % 16, z = i / 256;
      const VoxelBlock* block = map.find({2 * key.x + x / 8, 2 * key.y + y / 8, 2 * key.z + z / 8});
      const int v = x % 8 + 8 * (y % 8 + 8 * (z % 8));
      const bool seen = block && block->weight[v] >= config.min_publish_weight;
      ASSERT_EQ(decoded.observed[i] != 0, seen);
      if (!seen) continue;
      ++observed;
      owned += block->owner[v] == 300000;
      ASSERT_EQ(decoded.owner[i], block->owner[v]);
      // Half a step of 1/127, plus single precision.
      ASSERT_NEAR(decoded.distance_m[i], block->tsdf[v] / 32767.0 * config.truncation_m(),
                  config.truncation_m() / 254 + 1e-6);
    }
  }
  EXPECT_GT(observed, 10000u);
  EXPECT_GT(owned, 500u);
}

TEST(MapPublisher, DeltasCarryExactlyWhatChanged) {
  TsdfConfig config = coarse_config();
  config.min_publish_weight = 2;
  TsdfMap map(config);
  ThreadPool pool(1);
  MapPublisher publisher(42, config);
  EXPECT_FALSE(publisher.update(map));
  EXPECT_EQ(publisher.digest(), MapDigest{});

  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  map.integrate(look(ball_scene(0), pose).input(), pool);
  // Weight 1 is below the threshold.
  EXPECT_FALSE(publisher.update(map));
  map.integrate(look(ball_scene(0), pose).input(), pool);
  const auto first = publisher.update(map);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->epoch, 42u);
  EXPECT_EQ(first->base_version, 0u);
  EXPECT_EQ(first->version, 1u);
  EXPECT_EQ(first->changed.size(), publisher.tiles().size());

  // The same view again changes weights only: nothing to publish.
  map.integrate(look(ball_scene(0), pose).input(), pool);
  EXPECT_FALSE(publisher.update(map));
  EXPECT_EQ(publisher.version(), 1u);

  const auto before = publisher.tiles();
  map.clear_object(ObjectId{300000});
  const auto second = publisher.update(map);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->base_version, 1u);
  std::map<TileKey, MapTile> after = before;
  for (const TileKey& key : second->removed) EXPECT_EQ(after.erase(key), 1u);
  for (const MapTile& tile : second->changed) {
    EXPECT_NE(after[tile.key].payload, tile.payload);
    EXPECT_EQ(tile.version, 2u);
    after[tile.key] = tile;
  }
  ASSERT_EQ(after.size(), publisher.tiles().size());
  MapDigest sum;
  for (const auto& [key, tile] : after) {
    EXPECT_EQ(tile.payload, publisher.tiles().at(key).payload);
    const MapDigest d = tile_digest(key, tile.payload);
    const std::uint64_t low = sum.low + d.low;
    sum.high += d.high + (low < sum.low ? 1 : 0);
    sum.low = low;
  }
  EXPECT_EQ(sum, publisher.digest());
  EXPECT_EQ(second->digest, publisher.digest());
}

TEST(MapPublisher, EmptiedTilesAreRemovedAndTheDigestOfNothingIsZero) {
  const TsdfConfig config = coarse_config();
  TsdfMap map(config);
  MapPublisher publisher(1, config);
  VoxelBlock& block = map.touch({-3, 4, 5});
  block.weight.fill(9);
  block.owner.fill(8);
  const auto added = publisher.update(map);
  ASSERT_TRUE(added);
  ASSERT_EQ(added->changed.size(), 1u);
  EXPECT_EQ(added->changed[0].key, (TileKey{-2, 2, 2}));
  EXPECT_NE(publisher.digest(), MapDigest{});
  map.clear_object(ObjectId{8});
  const auto removed = publisher.update(map);
  ASSERT_TRUE(removed);
  EXPECT_TRUE(removed->changed.empty());
  EXPECT_EQ(removed->removed, (std::vector<TileKey>{{-2, 2, 2}}));
  EXPECT_EQ(publisher.digest(), MapDigest{});
}

TEST(MapPublisher, FreeSpaceAloneIsNotPublished) {
  TsdfMap map(coarse_config());
  MapPublisher publisher(1, coarse_config());
  VoxelBlock& block = map.touch({0, 0, 0});
  block.weight.fill(9);
  block.tsdf.fill(32767);
  EXPECT_FALSE(publisher.update(map));
}

TEST(MapPublisher, DigestIsTheSameForEveryThreadCount) {
  std::vector<std::string> digests;
  for (const int threads : {1, 2, 3}) {
    TsdfMap map(coarse_config());
    ThreadPool pool(threads);
    MapPublisher publisher(1, coarse_config());
    int frame = 0;
    for (const Pose& pose : arc_of_poses(10, 6)) {
      map.integrate(look(ball_scene(frame++ < 5 ? -0.3 : 0.3), pose).input(), pool);
      if (frame % 3 == 0) publisher.update(map);
    }
    publisher.update(map);
    digests.push_back(publisher.digest().hex());
  }
  EXPECT_EQ(digests[0], digests[1]);
  EXPECT_EQ(digests[0], digests[2]);
  EXPECT_EQ(digests[0].size(), 32u);
}

TEST(MapDigest, DependsOnKeyAndPayload) {
  const std::vector<std::uint8_t> a{1, 2, 3}, b{1, 2, 4};
  EXPECT_NE(tile_digest({0, 0, 1}, a), tile_digest({0, 1, 0}, a));
  EXPECT_NE(tile_digest({0, 0, 1}, a), tile_digest({0, 0, 1}, b));
  // A fixed value: the digest is part of the interface between versions and hosts.
  EXPECT_EQ(tile_digest({1, -2, 3}, a).hex(), "76a5d01f050aace0e74193aa670a8515");
}

}  // namespace
}  // namespace pocd::testing
