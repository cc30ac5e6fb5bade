#include "block_store.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"
#include "region.hpp"

namespace pocd {
namespace {

/// For members that have the store to themselves: no other thread counts meanwhile.
void count(std::atomic<std::uint64_t>& counter, std::uint64_t more) {
  counter.store(counter.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
}

}  // namespace

BlockStore::BlockStore(const MapMemoryConfig& memory)
    : memory_(memory), file_(memory.limited() ? new PageFile(memory.folder) : nullptr) {}
BlockStore::~BlockStore() = default;

const BlockStore::Region* BlockStore::region(const BlockKey& region_key) const {
  const auto it = regions_.find(region_key);
  return it == regions_.end() ? nullptr : it->second.get();
}

BlockStore::Region* BlockStore::region(const BlockKey& region_key) {
  count(visits_.regions, 1);
  if (last_region_ && last_region_->key == region_key) return last_region_;
  const auto it = regions_.find(region_key);
  if (it == regions_.end()) return nullptr;
  return last_region_ = it->second.get();
}

BlockStore::Region& BlockStore::find_or_make_region(const BlockKey& region_key) {
  if (Region* known = region(region_key)) return *known;
  std::unique_ptr<Region>& made = regions_[region_key];
  made = std::make_unique<Region>();
  made->key = region_key;
  made->memory = std::make_unique<Region::InMemory>();
  ++regions_in_memory_;
  return *(last_region_ = made.get());
}

void BlockStore::unlink(Region& region) {
  (region.newer ? region.newer->older : newest_) = region.older;
  (region.older ? region.older->newer : oldest_) = region.newer;
  region.newer = region.older = nullptr;
}

void BlockStore::see(Region& region) {
  if (region.seen == pass_) return;
  if (region.seen > 0) unlink(region);
  region.seen = pass_;
  region.older = newest_;
  (newest_ ? newest_->newer : oldest_) = &region;
  newest_ = &region;
}

void BlockStore::enter(Region& region) {
  if (!region.memory) bring_back(region);
  see(region);
  count(visits_.blocks, region.memory->members.size());
}

std::uint32_t BlockStore::find(const BlockKey& key) const {
  const Region* r = region(key.region());
  return r && r->memory ? r->memory->slot_of[Region::place(key)] : kNoSlot;
}

bool BlockStore::contains(const BlockKey& key) const {
  const Region* r = region(key.region());
  return r && r->present[Region::place(key)];
}

std::uint32_t BlockStore::find_or_allocate(const BlockKey& key) {
  Region& r = find_or_make_region(key.region());
  if (!r.memory) bring_back(r);
  see(r);
  count(visits_.blocks, 1);
  const std::uint32_t known = r.memory->slot_of[Region::place(key)];
  if (known != kNoSlot) return known;
  const std::uint32_t slot = allocate(r, key);
  VoxelBlock& b = block(slot);
  b.tsdf.fill(0);
  b.weight.fill(0);
  b.owner.fill(0);
  r.present.set(Region::place(key));
  ++size_;
  return slot;
}

// The block's contents are left to the caller.
std::uint32_t BlockStore::allocate(Region& region, const BlockKey& key) {
  Region::InMemory& in = *region.memory;
  if (in.free_slots.empty()) add_chunk(region);
  const std::uint32_t slot = in.free_slots.back();
  in.free_slots.pop_back();
  in.slot_of[Region::place(key)] = slot;
  Meta& m = meta(slot);
  m.used = true;
  m.dirty_list = 0;
  m.position_in_region = static_cast<std::uint32_t>(in.members.size());
  in.members.push_back(slot);
  in.places.push_back(static_cast<std::uint16_t>(Region::place(key)));
  block(slot).key = key;
  return slot;
}

void BlockStore::add_chunk(Region& region) {
  make_room(sizeof(Chunk));
  if (free_chunks_.empty()) {
    free_chunks_.push_back(static_cast<std::uint32_t>(chunks_.size()));
    chunks_.emplace_back();
  }
  const std::uint32_t number = free_chunks_.back();
  free_chunks_.pop_back();
  if (spare_.empty()) {
    chunks_[number] = std::make_unique<Chunk>();
  } else {
    chunks_[number] = std::move(spare_.back());
    spare_.pop_back();
  }
  ++chunk_count_;
  chunks_[number]->region = &region;
  region.memory->chunks.push_back(number);
  for (std::uint32_t n = kChunkMask + 1; n-- > 0;) {
    region.memory->free_slots.push_back(number << kChunkShift | n);
  }
}

void BlockStore::release_memory(Region& region) {
  for (const std::uint32_t number : region.memory->chunks) {
    if (spare_.size() < kSpareChunks) spare_.push_back(std::move(chunks_[number]));
    chunks_[number].reset();
    free_chunks_.push_back(number);
    --chunk_count_;
  }
  region.memory.reset();
  --regions_in_memory_;
}

void BlockStore::erase(Region& region) {
  if (last_region_ == &region) last_region_ = nullptr;
  unlink(region);
  release_memory(region);
  regions_.erase(BlockKey(region.key));
}

void BlockStore::forget_owners(std::uint32_t slot) {
  Meta& m = meta(slot);
  for (const std::uint32_t owner : m.owners) {
    const auto entry = owner_slots_.find(owner);
    std::vector<std::uint32_t>& slots = entry->second;
    *std::find(slots.begin(), slots.end(), slot) = slots.back();
    slots.pop_back();
    if (slots.empty()) owner_slots_.erase(entry);
  }
  owner_entries_ -= m.owners.size();
  m.owners.clear();
}

void BlockStore::drop(std::uint32_t slot) {
  Meta& m = meta(slot);
  POCD_CHECK(m.used);
  if (m.dirty_list != 0) mark_dirty(slot);
  forget_owners(slot);
  m.used = false;

  Region& r = region_of_slot(slot);
  Region::InMemory& in = *r.memory;
  const std::uint32_t place = Region::place(block(slot).key);
  in.members[m.position_in_region] = in.members.back();
  in.places[m.position_in_region] = in.places.back();
  meta(in.members.back()).position_in_region = m.position_in_region;
  in.members.pop_back();
  in.places.pop_back();
  in.slot_of[place] = kNoSlot;
  in.free_slots.push_back(slot);
  r.present.reset(place);
  --size_;
  if (in.members.empty()) erase(r);
}

void BlockStore::clear() {
  if (file_) file_ = std::make_unique<PageFile>(memory_.folder);
  for (const BlockKey& key : sorted_keys()) list_dirty(key);
  regions_.clear();
  last_region_ = newest_ = oldest_ = nullptr;
  chunks_.clear();
  free_chunks_.clear();
  spare_.clear();
  owner_slots_.clear();
  owner_regions_on_disk_.clear();
  size_ = size_on_disk_ = regions_in_memory_ = chunk_count_ = owner_entries_ = 0;
}

std::vector<BlockKey> BlockStore::sorted_keys() const {
  std::vector<BlockKey> keys;
  keys.reserve(size_);
  for (const auto& [key, region] : regions_) {
    for (std::uint32_t place = 0; place < kRegionBlocks; ++place) {
      if (region->present[place]) keys.push_back(region->block_at(place));
    }
  }
  visits_.regions.fetch_add(regions_.size(), std::memory_order_relaxed);
  visits_.blocks.fetch_add(size_, std::memory_order_relaxed);
  std::sort(keys.begin(), keys.end());
  return keys;
}

void BlockStore::note_owner(std::uint32_t slot, std::uint32_t owner) {
  if (owner == 0) return;
  std::vector<std::uint32_t>& owners = meta(slot).owners;
  if (std::find(owners.begin(), owners.end(), owner) != owners.end()) return;
  owners.push_back(owner);
  owner_slots_[owner].push_back(slot);
  ++owner_entries_;
}

void BlockStore::note_owners(std::uint32_t slot) {
  std::uint32_t last = 0;
  for (const std::uint32_t owner : block(slot).owner) {
    if (owner != last) note_owner(slot, owner);
    last = owner;
  }
}

bool BlockStore::lacks_owner(std::uint32_t slot, std::uint32_t owner) const {
  const std::vector<std::uint32_t>& owners = meta(slot).owners;
  return owner != 0 && std::find(owners.begin(), owners.end(), owner) == owners.end();
}

bool BlockStore::lacks_owners(std::uint32_t slot) const {
  const std::uint32_t* row = block(slot).owner.data();
  std::uint32_t last = 0;
  for (int r = 0; r < VoxelBlock::kVoxels / VoxelBlock::kSide; ++r, row += VoxelBlock::kSide) {
    std::uint32_t other = 0;  // most rows have the owner of the one before
    for (int i = 0; i < VoxelBlock::kSide; ++i) other |= row[i] ^ last;
    if (other == 0) continue;
    for (int i = 0; i < VoxelBlock::kSide; ++i) {
      if (row[i] != last && lacks_owner(slot, row[i])) return true;
      last = row[i];
    }
  }
  return false;
}

std::vector<std::uint32_t> BlockStore::take_owner(std::uint32_t owner) {
  // Seen first, so that bringing a part of the owner back does not send another part away.
  if (const auto here = owner_slots_.find(owner); here != owner_slots_.end()) {
    for (const std::uint32_t slot : here->second) see(region_of_slot(slot));
  }
  if (const auto away = owner_regions_on_disk_.find(owner); away != owner_regions_on_disk_.end()) {
    const std::vector<BlockKey> keys = away->second;  // bring_back changes the list
    for (const BlockKey& key : keys) {
      if (Region* r = region(key)) enter(*r);
    }
  }
  const auto entry = owner_slots_.find(owner);
  if (entry == owner_slots_.end()) return {};
  std::vector<std::uint32_t> slots = std::move(entry->second);
  owner_slots_.erase(entry);
  for (const std::uint32_t slot : slots) {
    std::vector<std::uint32_t>& owners = meta(slot).owners;
    owners.erase(std::find(owners.begin(), owners.end(), owner));
  }
  owner_entries_ -= slots.size();
  count(visits_.blocks, slots.size());
  std::sort(slots.begin(), slots.end(),
            [this](std::uint32_t a, std::uint32_t b) { return block(a).key < block(b).key; });
  return slots;
}

void BlockStore::mark_dirty(std::uint32_t slot) {
  Meta& m = meta(slot);
  if (m.dirty_list == dirty_list_) return;
  m.dirty_list = dirty_list_;
  list_dirty(block(slot).key);
}

// A place whose block comes and goes is listed each time: without sorting out, the list would grow
// for as long as nobody takes it. Sorting when it has doubled costs little per entry.
void BlockStore::list_dirty(const BlockKey& key) {
  constexpr std::size_t kLeast = 4096;
  dirty_.push_back(key);
  if (dirty_.size() < std::max(kLeast, 2 * dirty_sorted_)) return;
  std::sort(dirty_.begin(), dirty_.end());
  dirty_.erase(std::unique(dirty_.begin(), dirty_.end()), dirty_.end());
  dirty_sorted_ = dirty_.size();
}

std::vector<BlockKey> BlockStore::take_dirty() {
  std::vector<BlockKey> keys = std::move(dirty_);
  dirty_.clear();
  dirty_sorted_ = 0;
  ++dirty_list_;  // no block is in the new list, in memory or on disk
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  if (keeps_unsaved_) {
    unsaved_.insert(unsaved_.end(), keys.begin(), keys.end());
    if (unsaved_.size() > unsaved_limit_) {
      std::sort(unsaved_.begin(), unsaved_.end());
      unsaved_.erase(std::unique(unsaved_.begin(), unsaved_.end()), unsaved_.end());
      unsaved_limit_ = std::max(unsaved_limit_, 2 * unsaved_.size());
    }
  }
  return keys;
}

std::vector<BlockKey> BlockStore::take_unsaved() {
  std::vector<BlockKey> keys = std::move(unsaved_);
  unsaved_.clear();
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace pocd
