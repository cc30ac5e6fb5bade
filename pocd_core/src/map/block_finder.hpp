// Which blocks a frame can change: those the truncation band passes through, and allocated ones in
// front of the surface.
#pragma once

#include <cstdint>
#include <vector>

#include "block_store.hpp"
#include "pocd/common/thread_pool.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "tsdf_kernel.hpp"

namespace pocd {

/// Throws InputError when the viewing pyramid up to the depth limit has too many blocks.
void check_view(const TsdfConfig& config, const CameraModel& camera, const Pose& T_W_C);

/// Keeps its buffers from frame to frame. The grid of block-sized cells spans the bounding box of
/// the viewing pyramid up to the depth limit.
class BlockFinder {
 public:
  /// Marks the cells that the band of a regular sample of pixels passes through and notes the
  /// farthest depth of every image tile. Throws InputError when the pyramid has far too many
  /// blocks.
  void scan(const TsdfConfig& config, const IntegrationInput& input, ThreadPool& pool);

  /// Keys of the marked cells, canonical order.
  const std::vector<BlockKey>& band();

  /// Allocated blocks outside of the band that reach into the space that the frame saw, free or
  /// within the truncation distance (the sampled rays miss blocks of which they would cut only a
  /// corner).
  void append_seen(BlockStore& store, ThreadPool& pool, std::vector<std::uint32_t>& slots);

 private:
  static constexpr int kTile_px = 16;

  void place_grid();
  void scan_tile_row(int tile_row);
  bool in_band(const BlockKey& key) const;
  /// Farthest sampled depth over the image area of a sphere, 0 when it is out of view.
  float farthest_depth(const Eigen::Vector3d& center_C, double radius) const;

  const IntegrationInput* input_ = nullptr;
  TsdfConfig config_;
  double block_m_ = 0.0;
  int step_px_ = 4;
  std::vector<std::int32_t> columns_, owner_columns_;  // of the sampled pixels
  BlockKey first_;                                     // key of cell (0, 0, 0)
  int size_x_ = 0, size_y_ = 0, size_z_ = 0;
  std::vector<std::uint8_t> marks_;  // per cell; written by several threads, always the same value
  int tiles_x_ = 0, tiles_y_ = 0;
  std::vector<float> tile_far_;
  std::vector<std::int32_t> cells_;  // scratch of scan_tile_row, one part per row
  std::vector<BlockKey> band_;
  std::vector<const BlockStore::Region*> regions_;  // in view
  std::vector<std::size_t> seen_begin_;             // where those of each region begin in seen_
  std::vector<std::uint8_t> seen_;  // by member: it reaches into what was seen, outside of the band
};

}  // namespace pocd
