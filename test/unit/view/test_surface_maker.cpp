#include "view/surface_maker.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pieces.hpp"

namespace pocd::view::testing {
namespace {

TsdfConfig config() {
  TsdfConfig config;
  config.voxel_size_m = 0.05;
  return config;
}

/// A floor of `side` x `side` tiles at a height in voxels, as published.
std::map<TileKey, MapTile> floor_of(int side, double height_voxels, int hole = -1) {
  TsdfMap map(config());
  for (int y = 0; y < 16 * side; ++y) {
    for (int x = 0; x < 16 * side; ++x) {
      if (hole >= 0 && x / 16 == hole) continue;
      for (int z = 0; z < 16; ++z) {
        VoxelBlock& block = map.touch({x >> 3, y >> 3, z >> 3});
        const int v = (x & 7) + 8 * ((y & 7) + 8 * (z & 7));
        const double d = (z - height_voxels) * config().voxel_size_m / config().truncation_m();
        block.weight[v] = 9;
        block.tsdf[v] = static_cast<std::int16_t>(std::lround(32767 * std::clamp(d, -1.0, 1.0)));
      }
    }
  }
  MapPublisher publisher(1, config());
  publisher.update(map);
  return publisher.tiles();
}

struct Page {
  void use(const Board::Surfaces& surfaces) {
    for (const auto& [key, piece] : surfaces.tiles) {
      const ReadPiece read = read_piece(piece);
      ++drawn;
      if (read.vertices() == 0)
        tiles.erase(key);
      else
        tiles[key] = read;
    }
    for (const auto& [key, piece] : surfaces.chunks) chunks[key] = read_piece(piece);
  }
  void all(SurfaceMaker& maker) {
    while (!maker.idle()) use(maker.make(7));
  }
  std::map<TileKey, ReadPiece> tiles;
  std::map<ChunkKey, ReadPiece> chunks;
  int drawn = 0;
};

TEST(SurfaceMaker, DrawsTilesAndChunksOnce) {
  SurfaceMaker maker;
  Page page;
  maker.update(floor_of(5, 7.5), 1, config().voxel_size_m, config().truncation_m());
  page.all(maker);
  EXPECT_EQ(page.tiles.size(), 25u);
  EXPECT_EQ(page.chunks.size(), 4u);
  for (const auto& [key, chunk] : page.chunks) {
    EXPECT_GT(chunk.vertices(), 0u);
    for (std::size_t v = 0; v < chunk.vertices(); ++v) EXPECT_EQ(chunk.earlier(v), 0);
  }
  maker.update(floor_of(5, 7.5), 1, config().voxel_size_m, config().truncation_m());
  EXPECT_TRUE(maker.idle());
}

TEST(SurfaceMaker, AChangeIsTheSameAsAllAnew) {
  SurfaceMaker step, anew;
  Page stepped, fresh;
  step.update(floor_of(5, 7.5), 1, config().voxel_size_m, config().truncation_m());
  stepped.all(step);
  const int before = stepped.drawn;
  // One column of tiles goes: the neighbours' borders change with it.
  step.update(floor_of(5, 7.5, 2), 1, config().voxel_size_m, config().truncation_m());
  stepped.all(step);
  anew.update(floor_of(5, 7.5, 2), 1, config().voxel_size_m, config().truncation_m());
  fresh.all(anew);
  EXPECT_LT(stepped.drawn - before, 25);
  ASSERT_EQ(stepped.tiles.size(), fresh.tiles.size());
  for (const auto& [key, tile] : fresh.tiles) EXPECT_EQ(stepped.tiles[key].body, tile.body);
  for (const auto& [key, chunk] : fresh.chunks) EXPECT_EQ(stepped.chunks[key].body, chunk.body);
}

TEST(SurfaceMaker, WhatANewRunHasNotSeenStaysAsEarlier) {
  SurfaceMaker maker;
  Page page;
  maker.update(floor_of(3, 7.5), 1, config().voxel_size_m, config().truncation_m());
  page.all(maker);
  maker.update(floor_of(1, 7.5), 2, config().voxel_size_m, config().truncation_m());
  page.all(maker);
  EXPECT_EQ(page.tiles.size(), 9u);
  EXPECT_EQ((page.tiles[{0, 0, 0}].run), 2u);
  EXPECT_EQ((page.tiles[{2, 2, 0}].run), 1u);
  EXPECT_EQ(maker.earlier_tiles(), 8u);
  std::size_t earlier = 0;
  const ReadPiece& chunk = page.chunks[{0, 0, 0}];
  for (std::size_t v = 0; v < chunk.vertices(); ++v) earlier += chunk.earlier(v);
  EXPECT_GT(earlier, 0u);
  EXPECT_LT(earlier, chunk.vertices());
}

TEST(SurfaceMaker, CountsTilesThatAreNone) {
  SurfaceMaker maker;
  Page page;
  auto tiles = floor_of(2, 7.5);
  tiles[{1, 1, 0}].payload = std::vector<std::uint8_t>{1, 2, 3};
  maker.update(tiles, 1, config().voxel_size_m, config().truncation_m());
  page.all(maker);
  EXPECT_EQ(maker.unreadable(), 1u);
  EXPECT_EQ(page.tiles.size(), 3u);
}

}  // namespace
}  // namespace pocd::view::testing
