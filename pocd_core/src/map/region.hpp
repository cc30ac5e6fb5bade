// A region of the block store.
#pragma once

#include "block_store.hpp"

namespace pocd {

struct BlockStore::Region {
  struct InMemory {
    InMemory() { slot_of.fill(kNoSlot); }
    std::array<std::uint32_t, kRegionBlocks> slot_of;  // by place
    std::vector<std::uint32_t> members, free_slots, chunks;
    std::vector<std::uint16_t> places;  // of the members
  };

  BlockKey key;                        // block key >> kRegionShift
  std::bitset<kRegionBlocks> present;  // blocks there are, in memory or on disk, by place
  std::uint64_t seen = 0;              // pass
  Region* older = nullptr;             // in the list of regions in memory
  Region* newer = nullptr;
  std::unique_ptr<InMemory> memory;  // null: on disk
  PageRef page;                      // while on disk
  bool stored = false;               // on disk, as it was before this process

  /// Number of a block within its region, x fastest.
  static std::uint32_t place(const BlockKey& block) {
    constexpr std::uint32_t kMask = (1u << kRegionShift) - 1;
    const auto bits = [](std::int32_t v) { return static_cast<std::uint32_t>(v) & kMask; };
    return bits(block.x) | bits(block.y) << kRegionShift | bits(block.z) << (2 * kRegionShift);
  }
  BlockKey block_at(std::uint32_t place) const {
    constexpr int kSide = 1 << kRegionShift;
    const auto p = static_cast<std::int32_t>(place);
    return {key.x * kSide + p % kSide, key.y * kSide + p / kSide % kSide,
            key.z * kSide + p / kSide / kSide};
  }
};

}  // namespace pocd
