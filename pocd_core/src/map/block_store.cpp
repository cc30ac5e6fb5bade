#include "block_store.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

BlockKey region_of(const BlockKey& key) {
  constexpr int kShift = BlockStore::kRegionShift;
  return {key.x >> kShift, key.y >> kShift, key.z >> kShift};
}

}  // namespace

BlockStore::BlockStore() : table_(1024, kNoSlot) {}

// Position of the key in the table, or of the empty entry where it would go.
std::size_t BlockStore::probe(const BlockKey& key) const {
  const std::size_t mask = table_.size() - 1;
  std::size_t i = BlockKeyHash{}(key)&mask;
  while (table_[i] != kNoSlot && !(block(table_[i]).key == key)) i = (i + 1) & mask;
  return i;
}

std::uint32_t BlockStore::find(const BlockKey& key) const { return table_[probe(key)]; }

void BlockStore::grow_table() {
  std::vector<std::uint32_t> old(table_.size() * 2, kNoSlot);
  old.swap(table_);
  for (const std::uint32_t slot : old) {
    if (slot != kNoSlot) table_[probe(block(slot).key)] = slot;
  }
}

std::uint32_t BlockStore::find_or_allocate(const BlockKey& key) {
  std::size_t i = probe(key);
  if (table_[i] != kNoSlot) return table_[i];
  if ((size_ + 1) * 2 > table_.size()) {
    grow_table();
    i = probe(key);
  }
  if (free_.empty()) {
    const auto first = static_cast<std::uint32_t>(meta_.size());
    chunks_.push_back(std::make_unique<VoxelBlock[]>(kChunkMask + 1));
    meta_.resize(meta_.size() + kChunkMask + 1);
    for (std::uint32_t n = kChunkMask + 1; n-- > 0;) free_.push_back(first + n);
  }
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  table_[i] = slot;
  ++size_;
  VoxelBlock& b = block(slot);
  b.tsdf.fill(0);
  b.weight.fill(0);
  b.owner.fill(0);
  b.key = key;
  std::vector<std::uint32_t>& members = regions_[region_of(key)];
  Meta& meta = meta_[slot];
  meta.stamp = 0;
  meta.used = true;
  meta.dirty = false;
  meta.known = false;
  meta.position_in_region = static_cast<std::uint32_t>(members.size());
  members.push_back(slot);
  return slot;
}

void BlockStore::drop(std::uint32_t slot) {
  Meta& meta = meta_[slot];
  POCD_CHECK(meta.used);
  const BlockKey key = block(slot).key;
  if (meta.known) mark_dirty(slot);

  // Deletion without markers: later entries of the probe run move up (Knuth, TAOCP 6.4, R).
  const std::size_t mask = table_.size() - 1;
  std::size_t hole = probe(key);
  for (std::size_t i = (hole + 1) & mask; table_[i] != kNoSlot; i = (i + 1) & mask) {
    const std::size_t home = BlockKeyHash{}(block(table_[i]).key) & mask;
    if (((i - home) & mask) >= ((i - hole) & mask)) {
      table_[hole] = table_[i];
      hole = i;
    }
  }
  table_[hole] = kNoSlot;

  const auto region = regions_.find(region_of(key));
  std::vector<std::uint32_t>& members = region->second;
  members[meta.position_in_region] = members.back();
  meta_[members.back()].position_in_region = meta.position_in_region;
  members.pop_back();
  if (members.empty()) regions_.erase(region);

  for (const std::uint32_t owner : meta.owners) {
    const auto entry = owner_slots_.find(owner);
    std::vector<std::uint32_t>& slots = entry->second;
    *std::find(slots.begin(), slots.end(), slot) = slots.back();
    slots.pop_back();
    if (slots.empty()) owner_slots_.erase(entry);
  }
  meta.owners.clear();
  meta.used = false;
  meta.stamp = 0;
  free_.push_back(slot);
  --size_;
}

const std::vector<std::uint32_t>* BlockStore::region(const BlockKey& region_key) const {
  const auto it = regions_.find(region_key);
  return it == regions_.end() ? nullptr : &it->second;
}

std::vector<BlockKey> BlockStore::sorted_keys() const {
  std::vector<BlockKey> keys;
  keys.reserve(size_);
  for (std::uint32_t slot = 0; slot < meta_.size(); ++slot) {
    if (meta_[slot].used) keys.push_back(block(slot).key);
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

void BlockStore::note_owner(std::uint32_t slot, std::uint32_t owner) {
  if (owner == 0) return;
  std::vector<std::uint32_t>& owners = meta_[slot].owners;
  if (std::find(owners.begin(), owners.end(), owner) != owners.end()) return;
  owners.push_back(owner);
  owner_slots_[owner].push_back(slot);
}

void BlockStore::note_owners(std::uint32_t slot) {
  std::uint32_t last = 0;
  for (const std::uint32_t owner : block(slot).owner) {
    if (owner != last) note_owner(slot, owner);
    last = owner;
  }
}

std::vector<std::uint32_t> BlockStore::take_owner(std::uint32_t owner) {
  const auto entry = owner_slots_.find(owner);
  if (entry == owner_slots_.end()) return {};
  std::vector<std::uint32_t> slots = std::move(entry->second);
  owner_slots_.erase(entry);
  for (const std::uint32_t slot : slots) {
    std::vector<std::uint32_t>& owners = meta_[slot].owners;
    owners.erase(std::find(owners.begin(), owners.end(), owner));
  }
  std::sort(slots.begin(), slots.end(),
            [this](std::uint32_t a, std::uint32_t b) { return block(a).key < block(b).key; });
  return slots;
}

void BlockStore::mark_dirty(std::uint32_t slot) {
  if (meta_[slot].dirty) return;
  meta_[slot].dirty = true;
  meta_[slot].known = true;
  dirty_.push_back(block(slot).key);
}

std::vector<BlockKey> BlockStore::take_dirty() {
  std::vector<BlockKey> keys = std::move(dirty_);
  dirty_.clear();
  for (const BlockKey& key : keys) {
    const std::uint32_t slot = find(key);
    if (slot != kNoSlot) meta_[slot].dirty = false;
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace pocd
