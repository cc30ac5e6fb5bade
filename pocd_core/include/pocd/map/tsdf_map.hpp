// The map: a hash of voxel blocks with TSDF, weight and owning object per voxel.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/thread_pool.hpp"
#include "pocd/common/types.hpp"
#include "pocd/input/frame.hpp"
#include "pocd/map/map_edits.hpp"
#include "pocd/map/region_source.hpp"
#include "pocd/map/tsdf_config.hpp"
#include "pocd/map/voxel_block.hpp"

namespace pocd {

class BlockStore;

/// What integrate_frame needs beside the frame.
struct IntegrationInput {
  const Frame* frame = nullptr;
  /// Row-major, one entry per pixel of the frame downscaled by `owner_stride`: the ObjectId index
  /// that owns the surface seen there, 0 background, kSkip = do not integrate this pixel.
  const std::uint32_t* owners = nullptr;
  int owner_width = 0;
  int owner_height = 0;
  int owner_stride = 1;
  static constexpr std::uint32_t kSkip = 0xFFFFFFFFu;
};

/// Not thread-safe: one writer, no reader beside it.
///
/// With a memory budget the least recently seen regions are on disk, and come back when a member
/// that changes the map meets them. A region that cannot be read back is lost: counted, reported by
/// take_problem(), and its blocks are dirty, so that copies of the map lose it too.
class TsdfMap {
 public:
  /// Throws InputError when the configuration is of no use.
  explicit TsdfMap(const TsdfConfig& config);
  ~TsdfMap();
  TsdfMap(TsdfMap&&) noexcept;
  TsdfMap& operator=(TsdfMap&&) noexcept;

  const TsdfConfig& config() const;

  /// Fuses one depth image (projective TSDF): allocates the blocks within the truncation band of
  /// the observed surface, averages the signed distance in every allocated block in view, and
  /// carves known free space in front of the surface (a voxel that the ray passes through loses its
  /// surface within a few frames even at full weight). A voxel within the band takes the pixel's
  /// owner; a block left with free space only is dropped. Bit-identical for every thread count.
  void integrate(const IntegrationInput& input, ThreadPool& pool);
  /// Throws InputError when integrate() could not take the frame, since what it sees holds too many
  /// voxels or is too far away.
  void check_view(const Frame& frame) const;

  /// Resets exactly the voxels owned by `id` to unknown (weight 0, owner 0), drops blocks that end
  /// empty, returns how many voxels were reset. Cost grows with the object, not with the map.
  std::size_t clear_object(ObjectId id);

  /// The same for those of its voxels whose centre [m, W] `inside` accepts; the object keeps the
  /// others.
  std::size_t clear_object_where(ObjectId id,
                                 const std::function<bool(const Eigen::Vector3d&)>& inside);

  /// Resets all voxels, of any owner, whose centre [m, W] lies in the column between `low` and
  /// `high` [m, W] and is accepted by `inside`; drops blocks that end without a surface. Reads the
  /// regions of the column back from disk. Returns how many voxels were reset.
  std::size_t clear_column(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const std::function<bool(const Eigen::Vector2d&)>& inside);

  /// Everything becomes unknown. Reads nothing from disk. Throws InputError, with nothing changed,
  /// when map.memory.folder takes no new file.
  void clear();

  /// Voxels of `from` become voxels of `to` (two library entries found to be one thing).
  std::size_t reassign_object(ObjectId from, ObjectId to);

  std::size_t block_count() const;  ///< in memory and on disk
  /// Null where nothing is allocated. Valid until the next change of the map. The block must be in
  /// memory, as all are without a budget: MapReader finds those on disk.
  const VoxelBlock* find(const BlockKey& key) const;
  /// Signed distance [m] of the voxel that holds the point, positive in front of a surface; nothing
  /// where fewer than `min_weight` looks measured it, or once the pending edits are made. Brings
  /// its region back to memory: what is on disk must not change what follows.
  std::optional<double> distance_at(const Eigen::Vector3f& point_W, int min_weight,
                                    const MapEdits& pending = {});
  /// For tests and loading: the block at key, allocated when missing; marked dirty.
  VoxelBlock& touch(const BlockKey& key);
  /// Keys of all blocks in canonical order (BlockKey::operator<).
  std::vector<BlockKey> sorted_keys() const;
  /// The same keys, sorted by region, then by key: the order for reading the whole map.
  std::vector<BlockKey> keys_by_region() const;

  /// Keys of blocks changed (or dropped) since the last call, canonical order; clears the list.
  std::vector<BlockKey> take_dirty();

  /// From now on take_unsaved() gives the keys that take_dirty() has given since its own last call:
  /// for who writes down what was published.
  void keep_unsaved();
  std::vector<BlockKey> take_unsaved();
  /// Puts regions that were there before this process into an empty map: their voxels are read from
  /// `source` when they are needed. Nothing of it is dirty.
  void restore(const std::vector<StoredRegion>& regions, std::shared_ptr<RegionSource> source);

  /// Brings the region of a block back to memory, or finds that it is lost.
  void recall(const BlockKey& key);
  MapMemoryStatus memory_status() const;
  /// The first thing that went wrong with the disk since the last call, one line.
  std::optional<std::string> take_problem();
  /// Parts of the map that were handed out since it was made.
  MapVisits visits() const;

 private:
  friend class MapReader;
  const BlockStore& store() const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd
