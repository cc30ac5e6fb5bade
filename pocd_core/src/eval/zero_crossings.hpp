// Zero crossings of a signed distance on the edges of a blocked voxel grid.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/map/voxel_block.hpp"

namespace pocd {

/// block_at(key) -> const Block* or null; value(block, index, v) -> whether the voxel is observed,
/// with v = signed distance over truncation. Order: by block, voxel, axis.
template <class Block, class BlockAt, class Value>
Points zero_crossings(const std::vector<BlockKey>& keys, double voxel_size_m,
                      const BlockAt& block_at, const Value& value) {
  constexpr int kSide = VoxelBlock::kSide;
  constexpr float kFree = 0.9f;
  constexpr std::array<int, 3> kStep{1, kSide, kSide * kSide};
  Points points;
  for (const BlockKey& key : keys) {
    const Block* block = block_at(key);
    if (!block) continue;
    const std::array<const Block*, 3> next{block_at({key.x + 1, key.y, key.z}),
                                           block_at({key.x, key.y + 1, key.z}),
                                           block_at({key.x, key.y, key.z + 1})};
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      float a = 0.0f;
      if (!value(*block, i, a) || a >= kFree) continue;
      const std::array<int, 3> at{i % kSide, (i / kSide) % kSide, i / (kSide * kSide)};
      for (int axis = 0; axis < 3; ++axis) {
        const bool inside = at[axis] + 1 < kSide;
        const Block* other = inside ? block : next[axis];
        if (!other) continue;
        const int j = inside ? i + kStep[axis] : i - (kSide - 1) * kStep[axis];
        float b = 0.0f;
        if (!value(*other, j, b) || b >= kFree || (a > 0.0f) == (b > 0.0f)) continue;
        Eigen::Vector3f p((static_cast<float>(8 * key.x + at[0]) + 0.5f),
                          (static_cast<float>(8 * key.y + at[1]) + 0.5f),
                          (static_cast<float>(8 * key.z + at[2]) + 0.5f));
        p[axis] += a / (a - b);
        points.push_back(p * static_cast<float>(voxel_size_m));
      }
    }
  }
  return points;
}

}  // namespace pocd
