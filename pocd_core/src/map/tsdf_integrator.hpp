// One depth image into the map. The steps: find the blocks, fuse each on its own, then settle what
// touches shared state (drops, owners, dirty list) in a fixed order.
#pragma once

#include <vector>

#include "block_finder.hpp"
#include "block_store.hpp"
#include "pocd/common/thread_pool.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "tsdf_kernel.hpp"

namespace pocd {

/// Keeps its buffers from frame to frame: nothing is allocated per voxel or pixel.
class TsdfIntegrator {
 public:
  void integrate(const TsdfConfig& config, const IntegrationInput& input, BlockStore& store,
                 ThreadPool& pool);

 private:
  void prepare(const TsdfConfig& config, const IntegrationInput& input);
  void settle(BlockStore& store);

  BlockFinder finder_;
  KernelFrame kernel_;
  std::vector<std::uint32_t> slots_;
  std::vector<BlockOutcome> outcomes_;
  std::uint32_t no_owner_ = 0;
};

}  // namespace pocd
