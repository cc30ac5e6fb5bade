// The slow, obvious integration that the fast one is compared with: every voxel of every block, one
// after the other, with the same single-precision formulas.
#pragma once

#include <map>
#include <vector>

#include "pocd/map/tsdf_map.hpp"

namespace pocd::testing {

class ReferenceIntegrator {
 public:
  explicit ReferenceIntegrator(const TsdfConfig& config) : config_(config) {}

  /// Fuses the view into all blocks known so far and those of `allocated`, then drops blocks
  /// without a surface.
  void integrate(const IntegrationInput& input, const std::vector<BlockKey>& allocated);

  const std::map<BlockKey, VoxelBlock>& blocks() const { return blocks_; }

 private:
  void fuse(const IntegrationInput& input, VoxelBlock& block) const;

  TsdfConfig config_;
  std::map<BlockKey, VoxelBlock> blocks_;
};

/// Keys of the blocks that hold a voxel with |signed distance| <= band voxels at its pixel.
std::vector<BlockKey> blocks_near_surface(const TsdfConfig& config, const IntegrationInput& input,
                                          double band_voxels);

}  // namespace pocd::testing
