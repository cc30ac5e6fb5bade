// The unit of storage of the map: 8 x 8 x 8 voxels, structure of arrays.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pocd {

/// Integer coordinates of a block: block b covers [8 b, 8 b + 8) voxels per axis in the map frame.
struct BlockKey {
  /// A region is 8 x 8 x 8 blocks: what is kept in memory or on disk as a whole.
  static constexpr int kRegionShift = 3;

  std::int32_t x = 0, y = 0, z = 0;
  bool operator==(const BlockKey& o) const { return x == o.x && y == o.y && z == o.z; }
  bool operator<(const BlockKey& o) const {  // z-major, the canonical order of every listing
    return z != o.z ? z < o.z : y != o.y ? y < o.y : x < o.x;
  }
  BlockKey region() const { return {x >> kRegionShift, y >> kRegionShift, z >> kRegionShift}; }
};

struct BlockKeyHash {
  std::size_t operator()(const BlockKey& k) const {
    std::uint64_t h = static_cast<std::uint32_t>(k.x) * 0x9E3779B97F4A7C15ull;
    h = (h ^ (h >> 29)) + static_cast<std::uint32_t>(k.y) * 0xBF58476D1CE4E5B9ull;
    h = (h ^ (h >> 29)) + static_cast<std::uint32_t>(k.z) * 0x94D049BB133111EBull;
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

/// Voxel (x, y, z) of a block, each in [0, 8), is element x + 8 (y + 8 z) of every array. Its
/// centre is at (8 key + (x, y, z) + 0.5) * voxel_size_m in the map frame. tsdf: signed distance to
/// the surface over the truncation distance, times 32767; positive in front. weight: 0 = never
/// seen. owner: index of the ObjectId that the voxel belongs to, 0 = background.
struct VoxelBlock {
  static constexpr int kSide = 8;
  static constexpr int kVoxels = kSide * kSide * kSide;

  alignas(64) std::array<std::int16_t, kVoxels> tsdf{};
  alignas(64) std::array<std::uint16_t, kVoxels> weight{};
  alignas(64) std::array<std::uint32_t, kVoxels> owner{};
  BlockKey key;
};

}  // namespace pocd
