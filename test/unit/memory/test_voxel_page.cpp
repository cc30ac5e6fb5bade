// Voxels of a tile to bytes and back, and the row that they are in.
#include <gtest/gtest.h>

#include <array>

#include "map/tile_codec.hpp"
#include "memory/voxel_page.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"

namespace pocd::memory {
namespace {

std::vector<VoxelBlock> random_blocks(Random& random, std::uint8_t mask, std::uint32_t owners) {
  std::vector<VoxelBlock> blocks(static_cast<std::size_t>(__builtin_popcount(mask)));
  for (VoxelBlock& block : blocks) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      block.tsdf[i] = static_cast<std::int16_t>(random.below(65536));
      block.weight[i] = static_cast<std::uint16_t>(random.below(1001));
      const auto owner = static_cast<std::uint32_t>(random.below(owners + 1));
      block.owner[i] = owner == 0 ? 0 : owner * 7919u;
      if (random.below(3) == 0) block.tsdf[i] = 0, block.weight[i] = 0, block.owner[i] = 0;
    }
  }
  return blocks;
}

/// As it is published.
std::vector<std::uint8_t> tile_of_blocks(std::uint8_t mask, const std::vector<VoxelBlock>& blocks) {
  std::array<const VoxelBlock*, 8> places{};
  std::size_t b = 0;
  for (std::size_t place = 0; place < 8; ++place) {
    if (mask >> place & 1) places[place] = &blocks[b++];
  }
  return encode_tile(places, 500);
}

TEST(VoxelPage, GivesBackEveryVoxel) {
  Random random(1);
  for (const std::uint32_t owners : {0u, 1u, 3u, 255u, 256u, 3000u}) {
    for (int trial = 0; trial < 9; ++trial) {
      const auto mask = static_cast<std::uint8_t>(1 + random.below(255));
      const std::vector<VoxelBlock> blocks = random_blocks(random, mask, owners);
      // With the tile of these voxels, of others, and with none.
      const std::vector<std::uint8_t> published =
          trial % 3 == 0   ? std::vector<std::uint8_t>{}
          : trial % 3 == 1 ? tile_of_blocks(mask, blocks)
                           : tile_of_blocks(0x81, random_blocks(random, 0x81, 2));
      const VoxelPage page = encode_voxels(mask, blocks.data(), published);
      std::vector<VoxelBlock> back;
      const TileKey key{-3, 5, 0};
      decode_voxels(key, mask, page.bytes, published, "test", back);
      ASSERT_EQ(back.size(), blocks.size());
      for (std::size_t b = 0; b < back.size(); ++b) {
        EXPECT_EQ(back[b].tsdf, blocks[b].tsdf);
        EXPECT_EQ(back[b].weight, blocks[b].weight);
        EXPECT_EQ(back[b].owner, blocks[b].owner);
        EXPECT_EQ(back[b].key.x >> 1, key.x);
        EXPECT_EQ(back[b].key.y >> 1, key.y);
        EXPECT_EQ(back[b].key.z >> 1, key.z);
      }
    }
  }
}

TEST(VoxelPage, DamagedBytesAreRefused) {
  Random random(2);
  const std::vector<VoxelBlock> blocks = random_blocks(random, 0x0F, 4);
  const std::vector<std::uint8_t> published = tile_of_blocks(0x0F, blocks);
  const VoxelPage page = encode_voxels(0x0F, blocks.data(), published);
  std::vector<VoxelBlock> back;
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<std::uint8_t> bytes = page.bytes;
    bytes.resize(random.below(bytes.size()));
    EXPECT_THROW(decode_voxels({0, 0, 0}, 0x0F, bytes, published, "test", back), InputError);
  }
  EXPECT_THROW(decode_voxels({0, 0, 0}, 0x1F, page.bytes, published, "test", back), InputError);
}

TEST(VoxelPage, RowsNameTilesAndThoseOfARegionFollowEachOther) {
  Random random(3);
  const auto coordinate = [&] {
    return static_cast<std::int32_t>(random.below(1 << 20)) - (1 << 19);
  };
  for (int trial = 0; trial < 10000; ++trial) {
    const TileKey tile{coordinate(), coordinate(), coordinate()};
    const std::int64_t row = row_of(tile);
    EXPECT_GE(row, 0);
    EXPECT_TRUE(tile_of(row) == tile);
    const BlockKey region = BlockKey{2 * tile.x, 2 * tile.y, 2 * tile.z}.region();
    EXPECT_GE(row, first_row_of(region));
    EXPECT_LT(row, first_row_of(region) + 64);
  }
}

}  // namespace
}  // namespace pocd::memory
