// BlockStore: regions to disk and back.
//
// A page is a zstd frame of, for every block of the region by place: u32 dirty list, i16 distances,
// u16 weights, u32 owners, in the byte order of this machine: no other process reads it.
#include <algorithm>
#include <cstring>

#include "block_store.hpp"
#include "pocd/common/check.hpp"
#include "region.hpp"
#include "zstd_codec.hpp"

namespace pocd {
namespace {

constexpr int kLevel = 1;
// The list of dirty blocks that those from before this process were in: their end is heard of.
constexpr std::uint32_t kListBefore = 1;
constexpr std::size_t kBlockBytes =
    4 + sizeof(VoxelBlock::tsdf) + sizeof(VoxelBlock::weight) + sizeof(VoxelBlock::owner);
// Nodes, vectors and buckets around an entry of a hash or list, by the layout of libstdc++.
constexpr std::size_t kRegionNodeBytes = 64, kOwnerEntryBytes = 48;

void put_block(const VoxelBlock& block, std::uint32_t dirty_list, std::uint8_t* out) {
  const auto put = [&out](const void* from, std::size_t size) {
    std::memcpy(out, from, size);
    out += size;
  };
  put(&dirty_list, sizeof dirty_list);
  put(block.tsdf.data(), sizeof block.tsdf);
  put(block.weight.data(), sizeof block.weight);
  put(block.owner.data(), sizeof block.owner);
}

std::uint32_t get_block(const std::uint8_t* in, VoxelBlock& block) {
  const auto get = [&in](void* to, std::size_t size) {
    std::memcpy(to, in, size);
    in += size;
  };
  std::uint32_t dirty_list = 0;
  get(&dirty_list, sizeof dirty_list);
  get(block.tsdf.data(), sizeof block.tsdf);
  get(block.weight.data(), sizeof block.weight);
  get(block.owner.data(), sizeof block.owner);
  return dirty_list;
}

// Visits each owner in a page once.
template <class Visit>
void for_each_owner(const std::vector<std::uint8_t>& raw, const Visit& visit) {
  std::vector<std::uint32_t> owners;
  VoxelBlock block;
  for (std::size_t at = 0; at < raw.size(); at += kBlockBytes) {
    get_block(&raw[at], block);
    std::uint32_t last = 0;
    for (const std::uint32_t owner : block.owner) {
      if (owner != last && owner != 0) owners.push_back(owner);
      last = owner;
    }
  }
  std::sort(owners.begin(), owners.end());
  owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
  for (const std::uint32_t owner : owners) visit(owner);
}

}  // namespace

std::uint64_t BlockStore::memory_bytes() const {
  return (chunk_count_ + spare_.size()) * sizeof(Chunk) + chunks_.capacity() * sizeof(chunks_[0]) +
         regions_in_memory_ * (sizeof(Region::InMemory) + kRegionBlocks) +
         regions_.size() * (sizeof(Region) + kRegionNodeBytes) + owner_entries_ * kOwnerEntryBytes +
         dirty_.capacity() * sizeof(BlockKey);
}

void BlockStore::make_room(std::uint64_t bytes) {
  if (!file_) return;
  if (!spare_.empty()) bytes = 0;
  while (memory_bytes() + bytes > memory_.budget_bytes()) {
    if (!evict_oldest()) {
      if (over_budget_pass_ != pass_) ++counts_.frames_over_budget;
      over_budget_pass_ = pass_;
      return;
    }
    if (!spare_.empty()) bytes = 0;
  }
}

bool BlockStore::evict_oldest() {
  if (!oldest_ || oldest_->seen == pass_ || failed_pass_ == pass_) return false;
  Region& region = *oldest_;
  if (region.memory->members.empty()) {  // what was there got lost
    erase(region);
    return true;
  }
  std::vector<std::uint8_t> raw(region.memory->members.size() * kBlockBytes);
  std::size_t at = 0;
  for (std::uint32_t place = 0; place < kRegionBlocks; ++place) {
    const std::uint32_t slot = region.memory->slot_of[place];
    if (slot == kNoSlot) continue;
    put_block(block(slot), meta(slot).dirty_list, &raw[at]);
    at += kBlockBytes;
  }
  const std::optional<PageRef> page = file_->write(compress(raw, kLevel));
  if (!page) {
    failed_pass_ = pass_;
    if (counts_.write_failures++ == 0 && !problem_) {
      problem_ = "map: memory budget exceeded, voxels cannot be written to \"" + file_->folder() +
                 "\": " + file_->error();
    }
    return false;
  }
  for (const std::uint32_t slot : region.memory->members) {
    forget_owners(slot);
    meta(slot).used = false;
  }
  for_each_owner(raw, [&](std::uint32_t owner) {
    owner_regions_on_disk_[owner].push_back(region.key);
    ++owner_entries_;
  });
  size_on_disk_ += region.memory->members.size();
  unlink(region);
  region.seen = 0;
  region.page = *page;
  release_memory(region);
  ++counts_.evictions;
  return true;
}

void BlockStore::restore(const std::vector<StoredRegion>& regions,
                         std::shared_ptr<RegionSource> source) {
  source_ = std::move(source);
  dirty_list_ = std::max(dirty_list_, kListBefore + 1);
  for (const StoredRegion& stored : regions) {
    if (stored.present.none()) continue;
    const auto [entry, fresh] = regions_.try_emplace(stored.key);
    POCD_CHECK(fresh);
    entry->second = std::make_unique<Region>();
    Region& region = *entry->second;
    region.key = stored.key;
    region.present = stored.present;
    region.stored = true;
    size_ += stored.present.count();
    size_on_disk_ += stored.present.count();
    for (const std::uint32_t owner : stored.owners) {
      owner_regions_on_disk_[owner].push_back(stored.key);
      ++owner_entries_;
    }
  }
}

std::vector<std::uint8_t> BlockStore::read_stored(const Region& region) const {
  const std::vector<VoxelBlock> blocks = source_->read(region.key);
  std::vector<std::uint8_t> raw(blocks.size() * kBlockBytes);
  std::size_t n = 0;
  for (std::uint32_t place = 0; place < kRegionBlocks; ++place) {
    if (!region.present[place]) continue;
    if (n == blocks.size() || !(blocks[n].key == region.block_at(place))) break;
    put_block(blocks[n], kListBefore, &raw[n * kBlockBytes]);
    ++n;
  }
  if (n != blocks.size() || n != region.present.count()) {
    throw InputError("map: a stored region has other blocks than its index");
  }
  return raw;
}

std::vector<std::uint8_t> BlockStore::read_page(const Region& region) const {
  if (region.stored) return read_stored(region);
  const std::string source = "map: voxels in \"" + file_->folder() + "\"";
  std::string reason;
  const auto frame = file_->read(region.page, reason);
  if (!frame) throw InputError(source + ": " + reason);
  std::vector<std::uint8_t> raw =
      decompress(frame->data(), frame->size(), kRegionBlocks * kBlockBytes, source);
  if (raw.size() != region.present.count() * kBlockBytes) {
    throw InputError(source + ": a page has the wrong number of blocks");
  }
  return raw;
}

void BlockStore::bring_back(Region& region) {
  std::vector<std::uint8_t> raw;
  std::string reason;
  try {
    raw = read_page(region);
  } catch (const InputError& error) {
    reason = error.what();
  }
  if (!region.stored) file_->release(region.page);
  region.stored = false;
  region.memory = std::make_unique<Region::InMemory>();
  ++regions_in_memory_;
  size_on_disk_ -= region.present.count();
  see(region);
  if (!reason.empty()) {
    lose(region, reason);
    return;
  }
  for_each_owner(raw, [&](std::uint32_t owner) {
    const auto entry = owner_regions_on_disk_.find(owner);
    if (entry == owner_regions_on_disk_.end()) return;  // not in the index of a stored region
    std::vector<BlockKey>& keys = entry->second;
    const auto at = std::find(keys.begin(), keys.end(), region.key);
    if (at == keys.end()) return;
    *at = keys.back();
    keys.pop_back();
    if (keys.empty()) owner_regions_on_disk_.erase(entry);
    --owner_entries_;
  });
  std::size_t at = 0;
  for (std::uint32_t place = 0; place < kRegionBlocks; ++place) {
    if (!region.present[place]) continue;
    const std::uint32_t slot = allocate(region, region.block_at(place));
    meta(slot).dirty_list = get_block(&raw[at], block(slot));
    note_owners(slot);
    at += kBlockBytes;
  }
  ++counts_.returns;
}

// Copies of the map hear of it: the blocks are dirty.
void BlockStore::lose(Region& region, const std::string& reason) {
  const std::size_t blocks = region.present.count();
  for (std::uint32_t place = 0; place < kRegionBlocks; ++place) {
    if (region.present[place]) list_dirty(region.block_at(place));
  }
  region.present.reset();
  size_ -= blocks;
  // Whose voxels they were stood on the page; nothing of the region is on disk any more.
  for (auto entry = owner_regions_on_disk_.begin(); entry != owner_regions_on_disk_.end();) {
    std::vector<BlockKey>& keys = entry->second;
    const auto left = std::remove(keys.begin(), keys.end(), region.key);
    owner_entries_ -= static_cast<std::size_t>(keys.end() - left);
    keys.erase(left, keys.end());
    entry = keys.empty() ? owner_regions_on_disk_.erase(entry) : std::next(entry);
  }
  if (counts_.blocks_lost == 0 && !problem_) {
    problem_ = reason + ": " + std::to_string(blocks) + " blocks around block (" +
               std::to_string(region.key.x * 8) + ", " + std::to_string(region.key.y * 8) + ", " +
               std::to_string(region.key.z * 8) + ") are lost";
  }
  counts_.blocks_lost += blocks;
}

std::vector<VoxelBlock> BlockStore::read_evicted(const Region& region) const {
  const std::vector<std::uint8_t> raw = read_page(region);
  std::vector<VoxelBlock> blocks(raw.size() / kBlockBytes);
  std::size_t n = 0;
  for (std::uint32_t place = 0; place < kRegionBlocks; ++place) {
    if (!region.present[place]) continue;
    get_block(&raw[n * kBlockBytes], blocks[n]);
    blocks[n++].key = region.block_at(place);
  }
  return blocks;
}

MapMemoryStatus BlockStore::memory_status() const {
  MapMemoryStatus status = counts_;
  status.limited = memory_.limited();
  status.budget_bytes = memory_.limited() ? memory_.budget_bytes() : 0;
  status.memory_bytes = memory_bytes();
  status.blocks_in_memory = size_ - size_on_disk_;
  status.blocks_on_disk = size_on_disk_;
  status.disk_bytes = file_ ? file_->used_bytes() : 0;
  return status;
}

std::optional<std::string> BlockStore::take_problem() {
  std::optional<std::string> problem = std::move(problem_);
  problem_.reset();
  return problem;
}

}  // namespace pocd
