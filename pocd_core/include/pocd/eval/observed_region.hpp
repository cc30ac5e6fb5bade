// The part of space that a drive had evidence about: nothing else may be judged.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd/map/voxel_block.hpp"

namespace pocd {

/// Voxels that depth images saw, or saw through, within a depth limit. Not thread-safe to add to.
class ObservedRegion {
 public:
  /// Depth within `margin_m` of a voxel's own counts as seeing it.
  ObservedRegion(double voxel_size_m, double max_depth_m, double margin_m)
      : voxel_size_m_(voxel_size_m), max_depth_m_(max_depth_m), margin_m_(margin_m) {}

  /// A voxel counts as seen when its centre is in view and the pixel's depth is within the margin,
  /// as seen through when the depth is farther by more. A return beyond the depth limit shows free
  /// space up to the limit; no return shows nothing. Counts as `frames` frames.
  void add(const Frame& frame, int frames = 1);

  struct Voxel {
    std::uint16_t seen = 0;          ///< frames
    std::uint16_t seen_through = 0;  ///< frames
  };
  /// Zeros where nothing is known.
  Voxel at(std::int32_t x, std::int32_t y, std::int32_t z) const;
  double voxel_size_m() const { return voxel_size_m_; }

  struct Block {
    BlockKey key;
    std::array<Voxel, VoxelBlock::kVoxels> voxels;
  };
  /// In order of creation, which depends on the frames alone.
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  double voxel_size_m_, max_depth_m_, margin_m_;
  std::vector<Block> blocks_;
  std::unordered_map<BlockKey, std::size_t, BlockKeyHash> index_;  // look-up only
};

}  // namespace pocd
