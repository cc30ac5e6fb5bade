// Regions of a map that were there before this process.
#pragma once

#include <bitset>
#include <cstdint>
#include <vector>

#include "pocd/map/voxel_block.hpp"

namespace pocd {

/// What is known of a region whose voxels have not been read yet.
struct StoredRegion {
  static constexpr int kBlocks = 1 << (3 * BlockKey::kRegionShift);

  BlockKey key;                       ///< block key >> kRegionShift
  std::bitset<kBlocks> present;       ///< by the block's number within the region, x fastest
  std::vector<std::uint32_t> owners;  ///< whose voxels may be there, background left out
};

/// Where their voxels are. read() may be called from several threads.
class RegionSource {
 public:
  virtual ~RegionSource() = default;
  /// The blocks of a region in the order of their numbers within it. Throws InputError when they
  /// cannot be read.
  virtual std::vector<VoxelBlock> read(const BlockKey& region) const = 0;
};

}  // namespace pocd
