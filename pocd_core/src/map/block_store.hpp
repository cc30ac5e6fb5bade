// Where the voxel blocks live: regions of 8 x 8 x 8 blocks, found by a hash, in memory or on disk,
// and the blocks of each owner.
#pragma once

#include <array>
#include <atomic>
#include <bitset>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "page_file.hpp"
#include "pocd/map/map_memory.hpp"
#include "pocd/map/region_source.hpp"
#include "pocd/map/voxel_block.hpp"

namespace pocd {

/// Blocks are addressed by slot, a small integer that stays valid until the block is dropped or its
/// region is evicted. Slots are reused; nothing that leaves the map may depend on their numbers.
/// Not thread-safe, except that different blocks may be written from different threads, and const
/// members may run beside each other.
///
/// With a memory budget, room for a block is made by writing the least recently seen regions to
/// disk. "Seen" counts passes, not time: the same calls evict the same regions. A region that this
/// pass has seen is never evicted.
class BlockStore {
 public:
  static constexpr std::uint32_t kNoSlot = 0xFFFFFFFFu;
  static constexpr int kRegionShift = BlockKey::kRegionShift;
  static constexpr int kRegionBlocks = 1 << (3 * kRegionShift);

  /// Throws InputError when the folder for evicted regions is of no use.
  explicit BlockStore(const MapMemoryConfig& memory);
  ~BlockStore();

  struct Region;  // defined in region.hpp

  /// What is seen from now on is newer than everything before, and protected until the next call.
  void begin_pass() { ++pass_; }
  /// Evicts what must go; allocation does the same, but lists grow besides.
  void keep_budget() { make_room(0); }

  std::size_t size() const { return size_; }  ///< in memory and on disk
  /// kNoSlot for a block that is not in memory.
  std::uint32_t find(const BlockKey& key) const;
  /// Whether there is a block at key, in memory or on disk.
  bool contains(const BlockKey& key) const;
  /// The slot at key; a missing block is allocated with all voxels unknown. Sees its region.
  std::uint32_t find_or_allocate(const BlockKey& key);
  /// Returns the block to the pool and forgets it in every index.
  void drop(std::uint32_t slot);

  VoxelBlock& block(std::uint32_t slot) {
    return chunks_[slot >> kChunkShift]->blocks[slot & kChunkMask];
  }
  const VoxelBlock& block(std::uint32_t slot) const {
    return chunks_[slot >> kChunkShift]->blocks[slot & kChunkMask];
  }

  /// The region of this key (block key >> kRegionShift); null when it has no blocks.
  Region* region(const BlockKey& region_key);
  const Region* region(const BlockKey& region_key) const;
  /// Brings the region back to memory if need be, sees it.
  void enter(Region& region);

  /// All blocks, those on disk too, in canonical order.
  std::vector<BlockKey> sorted_keys() const;

  /// Notes that the block may hold voxels of the owner (0 is not noted).
  void note_owner(std::uint32_t slot, std::uint32_t owner);
  /// The same for every owner that the voxels of the block have now.
  void note_owners(std::uint32_t slot);
  /// Whether note_owner(), note_owners() would note anything new.
  bool lacks_owner(std::uint32_t slot, std::uint32_t owner) const;
  bool lacks_owners(std::uint32_t slot) const;
  /// Takes the blocks that may hold voxels of the owner, by key, and forgets them for that owner.
  /// Brings those on disk back.
  std::vector<std::uint32_t> take_owner(std::uint32_t owner);

  /// Nothing is there any more; all blocks that were are dirty. Throws InputError, with nothing
  /// changed, when there is no new file for evicted regions.
  void clear();

  /// Dirty blocks are listed once. drop() lists a block that was ever dirty. The list is at most
  /// twice as long as there are places in it, and a little.
  void mark_dirty(std::uint32_t slot);
  /// Canonical order; clears the list.
  std::vector<BlockKey> take_dirty();

  /// From now on take_unsaved() gives what take_dirty() has given, since its own last call.
  void keep_unsaved() { keeps_unsaved_ = true; }
  std::vector<BlockKey> take_unsaved();

  /// Regions that are read from `source` when they are entered. Only for a store that has none of
  /// them.
  void restore(const std::vector<StoredRegion>& regions, std::shared_ptr<RegionSource> source);

  /// The blocks of a region on disk, in the order of their bits in Region::present. Throws
  /// InputError when they cannot be read.
  std::vector<VoxelBlock> read_evicted(const Region& region) const;

  MapMemoryStatus memory_status() const;
  /// What went wrong first since the last call, one line.
  std::optional<std::string> take_problem();
  MapVisits visits() const { return {visits_.regions.load(), visits_.blocks.load()}; }

 private:
  static constexpr int kChunkShift = 3;
  static constexpr std::uint32_t kChunkMask = (1u << kChunkShift) - 1;
  static constexpr std::size_t kSpareChunks = 8;

  struct Meta {
    std::uint32_t position_in_region = 0;
    /// The list of dirty blocks that this one is or was last in; 0: never in any, so that nobody
    /// has to hear of its end.
    std::uint32_t dirty_list = 0;
    bool used = false;
    std::vector<std::uint32_t> owners;
  };
  /// Blocks of one region; memory comes and goes in chunks.
  struct Chunk {
    std::array<VoxelBlock, kChunkMask + 1> blocks;
    std::array<Meta, kChunkMask + 1> meta;
    Region* region = nullptr;
  };

  Meta& meta(std::uint32_t slot) { return chunks_[slot >> kChunkShift]->meta[slot & kChunkMask]; }
  const Meta& meta(std::uint32_t slot) const {
    return chunks_[slot >> kChunkShift]->meta[slot & kChunkMask];
  }
  Region& region_of_slot(std::uint32_t slot) { return *chunks_[slot >> kChunkShift]->region; }

  Region& find_or_make_region(const BlockKey& region_key);
  void see(Region& region);
  void unlink(Region& region);
  std::uint32_t allocate(Region& region, const BlockKey& key);
  void add_chunk(Region& region);
  void release_memory(Region& region);
  void forget_owners(std::uint32_t slot);
  void list_dirty(const BlockKey& key);
  void erase(Region& region);

  // block_eviction.cpp
  std::uint64_t memory_bytes() const;
  void make_room(std::uint64_t bytes);
  bool evict_oldest();
  void bring_back(Region& region);
  std::vector<std::uint8_t> read_page(const Region& region) const;
  std::vector<std::uint8_t> read_stored(const Region& region) const;
  void lose(Region& region, const std::string& reason);

  MapMemoryConfig memory_;
  std::unique_ptr<PageFile> file_;  // null without a budget
  std::unordered_map<BlockKey, std::unique_ptr<Region>, BlockKeyHash> regions_;
  Region* last_region_ = nullptr;  // most look-ups follow one in the same region
  Region* newest_ = nullptr;       // regions in memory, by when they were seen
  Region* oldest_ = nullptr;
  std::uint64_t pass_ = 1;

  std::vector<std::unique_ptr<Chunk>> chunks_;  // null: number is free
  std::vector<std::uint32_t> free_chunks_;      // numbers
  std::vector<std::unique_ptr<Chunk>> spare_;   // memory kept for the next need

  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> owner_slots_;
  std::unordered_map<std::uint32_t, std::vector<BlockKey>> owner_regions_on_disk_;
  std::vector<BlockKey> dirty_;
  std::size_t dirty_sorted_ = 0;  ///< length of dirty_ when it was sorted out last
  std::uint32_t dirty_list_ = 1;
  bool keeps_unsaved_ = false;
  std::vector<BlockKey> unsaved_;
  std::size_t unsaved_limit_ = 1 << 16;  // repetitions are dropped when there are more
  std::shared_ptr<const RegionSource> source_;

  std::size_t size_ = 0, size_on_disk_ = 0;
  std::size_t regions_in_memory_ = 0, chunk_count_ = 0, owner_entries_ = 0;
  std::uint64_t over_budget_pass_ = 0, failed_pass_ = 0;  // the last such pass
  MapMemoryStatus counts_;
  std::optional<std::string> problem_;
  /// Counted by const members too, which may run beside each other.
  struct Visits {
    std::atomic<std::uint64_t> regions{0}, blocks{0};
  };
  mutable Visits visits_;
};

}  // namespace pocd
