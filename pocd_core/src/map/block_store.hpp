// Where the voxel blocks live: a pool, a flat hash from key to slot, a coarse spatial index and the
// blocks of each owner.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "pocd/map/voxel_block.hpp"

namespace pocd {

/// Blocks are addressed by slot, a small integer that stays valid until the block is dropped. Slots
/// are reused; nothing that leaves the map may depend on their numbers. Not thread-safe, except
/// that different blocks may be written from different threads.
class BlockStore {
 public:
  static constexpr std::uint32_t kNoSlot = 0xFFFFFFFFu;
  /// A region is 8 x 8 x 8 blocks, the cell of the spatial index.
  static constexpr int kRegionShift = 3;

  BlockStore();

  std::size_t size() const { return size_; }
  std::uint32_t find(const BlockKey& key) const;
  /// The slot at key; a missing block is allocated with all voxels unknown.
  std::uint32_t find_or_allocate(const BlockKey& key);
  /// Returns the block to the pool and forgets it in every index.
  void drop(std::uint32_t slot);

  VoxelBlock& block(std::uint32_t slot) { return chunks_[slot >> kChunkShift][slot & kChunkMask]; }
  const VoxelBlock& block(std::uint32_t slot) const {
    return chunks_[slot >> kChunkShift][slot & kChunkMask];
  }

  /// Slots of the blocks in a region (key = block key >> kRegionShift); null when there are none.
  const std::vector<std::uint32_t>* region(const BlockKey& region_key) const;
  std::vector<BlockKey> sorted_keys() const;

  /// True once per stamp (> 0) and slot: tells whether this pass has met the block before.
  bool visit(std::uint32_t slot, std::uint64_t stamp) {
    if (meta_[slot].stamp == stamp) return false;
    meta_[slot].stamp = stamp;
    return true;
  }

  /// Notes that the block may hold voxels of the owner (0 is not noted).
  void note_owner(std::uint32_t slot, std::uint32_t owner);
  /// The same for every owner that the voxels of the block have now.
  void note_owners(std::uint32_t slot);
  /// Takes the blocks that may hold voxels of the owner, by key, and forgets them for that owner.
  std::vector<std::uint32_t> take_owner(std::uint32_t owner);

  /// Dirty blocks are listed once. drop() lists a block that was ever dirty.
  void mark_dirty(std::uint32_t slot);
  /// Canonical order; clears the list.
  std::vector<BlockKey> take_dirty();

 private:
  static constexpr int kChunkShift = 6;
  static constexpr std::uint32_t kChunkMask = (1u << kChunkShift) - 1;

  struct Meta {
    std::uint64_t stamp = 0;
    std::uint32_t position_in_region = 0;
    bool used = false;
    bool dirty = false;
    bool known = false;  // was dirty once: its end must be announced
    std::vector<std::uint32_t> owners;
  };

  std::size_t probe(const BlockKey& key) const;
  void grow_table();

  std::vector<std::unique_ptr<VoxelBlock[]>> chunks_;
  std::vector<Meta> meta_;
  std::vector<std::uint32_t> free_;
  std::vector<std::uint32_t> table_;  // open addressing, linear probing; size is a power of two
  std::size_t size_ = 0;
  std::unordered_map<BlockKey, std::vector<std::uint32_t>, BlockKeyHash> regions_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> owner_slots_;
  std::vector<BlockKey> dirty_;
};

}  // namespace pocd
