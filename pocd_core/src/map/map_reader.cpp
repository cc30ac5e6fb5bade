#include "pocd/map/map_reader.hpp"

#include <algorithm>

#include "block_store.hpp"
#include "region.hpp"

namespace pocd {

const VoxelBlock* MapReader::find(const BlockKey& key) {
  const BlockStore& store = map_.store();
  const BlockStore::Region* region = store.region(key.region());
  const std::uint32_t place = BlockStore::Region::place(key);
  if (!region || !region->present[place]) return nullptr;
  if (region->memory) return &store.block(region->memory->slot_of[place]);

  auto page = std::find_if(pages_.begin(), pages_.end(), [&](const std::unique_ptr<Page>& p) {
    return p->region == region->key;
  });
  if (page == pages_.end()) {
    auto read = std::make_unique<Page>(Page{region->key, store.read_evicted(*region)});
    if (pages_.size() < kPages) {
      page = pages_.insert(pages_.end(), std::move(read));
    } else {
      page = pages_.begin() + static_cast<std::ptrdiff_t>(oldest_);
      *page = std::move(read);
      oldest_ = (oldest_ + 1) % kPages;
    }
  }
  // Blocks are in the order of their keys within the region.
  const auto& blocks = (*page)->blocks;
  const auto at = std::lower_bound(
      blocks.begin(), blocks.end(), key,
      [](const VoxelBlock& block, const BlockKey& wanted) { return block.key < wanted; });
  return &*at;
}

}  // namespace pocd
