// Layout, inside one zstd frame, for the n blocks of the mask after each other (512 n voxels):
//   differences of the distances along x, low bytes, then high bytes
//   weights, low bytes, then high bytes
//   u32 number of owners p, p x u32 owners, ascending, then per voxel the index: 0 background, k
//   owner k-1; absent if p = 0, u8 if p < 256, else u16, low bytes, then high bytes
#include "voxel_page.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "../map/zstd_codec.hpp"
#include "pocd/common/check.hpp"

namespace pocd::memory {
namespace {

constexpr int kVoxels = VoxelBlock::kVoxels;
constexpr int kLevel = 1;
constexpr std::size_t kLargest = 8 * kVoxels * (2 + 2 + 2 + 4) + 4;

void put_planes(std::vector<std::uint8_t>& out, const std::vector<std::uint16_t>& values) {
  for (const std::uint16_t v : values) out.push_back(static_cast<std::uint8_t>(v));
  for (const std::uint16_t v : values) out.push_back(static_cast<std::uint8_t>(v >> 8));
}

/// Bounds-checked.
class Bytes {
 public:
  Bytes(const std::vector<std::uint8_t>& bytes, const std::string& source)
      : bytes_(bytes), source_(source) {}
  const std::uint8_t* take(std::size_t size) {
    if (size > bytes_.size() - at_) throw InputError(source_ + ": voxels are cut short");
    at_ += size;
    return bytes_.data() + at_ - size;
  }
  void finish() const {
    if (at_ != bytes_.size()) throw InputError(source_ + ": bytes after the voxels");
  }

 private:
  const std::vector<std::uint8_t>& bytes_;
  const std::string& source_;
  std::size_t at_ = 0;
};

}  // namespace

VoxelPage encode_voxels(std::uint8_t mask, const VoxelBlock* blocks) {
  const auto count = static_cast<std::size_t>(__builtin_popcount(mask));
  VoxelPage page;
  page.mask = mask;
  std::vector<std::uint16_t> values(count * kVoxels);
  std::vector<std::uint8_t> raw;
  raw.reserve(count * kVoxels * 5 + 64);
  for (std::size_t b = 0; b < count; ++b) {
    int before = 0;
    for (int i = 0; i < kVoxels; ++i) {
      values[b * kVoxels + i] = static_cast<std::uint16_t>(blocks[b].tsdf[i] - before);
      before = blocks[b].tsdf[i];
    }
  }
  put_planes(raw, values);
  for (std::size_t b = 0; b < count; ++b) {
    std::copy(blocks[b].weight.begin(), blocks[b].weight.end(), &values[b * kVoxels]);
  }
  put_planes(raw, values);
  for (std::size_t b = 0; b < count; ++b) {
    std::uint32_t last = 0;
    for (const std::uint32_t owner : blocks[b].owner) {
      if (owner != last && owner != 0) page.owners.push_back(owner);
      last = owner;
    }
  }
  std::sort(page.owners.begin(), page.owners.end());
  page.owners.erase(std::unique(page.owners.begin(), page.owners.end()), page.owners.end());
  const auto p = static_cast<std::uint32_t>(page.owners.size());
  const auto put32 = [&raw](std::uint32_t v) {
    for (int i = 0; i < 4; ++i) raw.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
  };
  put32(p);
  for (const std::uint32_t owner : page.owners) put32(owner);
  if (p > 0) {
    std::uint32_t last = 0;
    std::uint16_t index = 0;
    for (std::size_t b = 0; b < count; ++b) {
      for (int i = 0; i < kVoxels; ++i) {
        const std::uint32_t owner = blocks[b].owner[i];
        if (owner != last) {
          last = owner;
          const auto at = std::lower_bound(page.owners.begin(), page.owners.end(), owner);
          index = owner == 0 ? 0 : static_cast<std::uint16_t>(at - page.owners.begin() + 1);
        }
        values[b * kVoxels + i] = index;
      }
    }
    if (p < 256) {
      for (const std::uint16_t v : values) raw.push_back(static_cast<std::uint8_t>(v));
    } else {
      put_planes(raw, values);
    }
  }
  page.bytes = compress(raw, kLevel);
  return page;
}

void decode_voxels(const TileKey& key, std::uint8_t mask, const std::vector<std::uint8_t>& bytes,
                   const std::string& source, std::vector<VoxelBlock>& out) {
  const std::vector<std::uint8_t> raw = decompress(bytes.data(), bytes.size(), kLargest, source);
  const auto count = static_cast<std::size_t>(__builtin_popcount(mask));
  const std::size_t n = count * kVoxels;
  Bytes in(raw, source);
  const std::uint8_t* tsdf = in.take(2 * n);
  const std::uint8_t* weight = in.take(2 * n);
  std::uint32_t p = 0;
  std::memcpy(&p, in.take(4), 4);
  if (p > n) throw InputError(source + ": more owners than voxels");
  std::vector<std::uint32_t> owners(p + 1, 0);
  std::memcpy(owners.data() + 1, in.take(4 * std::size_t{p}), 4 * std::size_t{p});
  const std::uint8_t* index = p == 0 ? nullptr : in.take(p < 256 ? n : 2 * n);
  in.finish();
  std::size_t v = 0;
  for (int place = 0; place < 8; ++place) {
    if (!(mask >> place & 1)) continue;
    VoxelBlock& block = out.emplace_back();
    block.key = {2 * key.x + (place & 1), 2 * key.y + (place >> 1 & 1), 2 * key.z + (place >> 2)};
    int before = 0;
    for (int i = 0; i < kVoxels; ++i, ++v) {
      const auto difference = static_cast<std::uint16_t>(tsdf[v] | tsdf[n + v] << 8);
      before = static_cast<std::int16_t>(static_cast<std::uint16_t>(before + difference));
      block.tsdf[i] = static_cast<std::int16_t>(before);
      block.weight[i] = static_cast<std::uint16_t>(weight[v] | weight[n + v] << 8);
      if (p == 0) continue;
      const std::size_t k =
          p < 256 ? index[v] : static_cast<std::size_t>(index[v] | index[n + v] << 8);
      if (k > p) throw InputError(source + ": a voxel has an owner that is not listed");
      block.owner[i] = owners[k];
    }
  }
}

namespace {

constexpr int kAxisBits = 19;  // of a region; the tile within it has 6 bits
constexpr std::int64_t kHalf = std::int64_t{1} << (kAxisBits - 1);

std::int64_t region_row(std::int64_t x, std::int64_t y, std::int64_t z) {
  POCD_CHECK(x >= -kHalf && x < kHalf && y >= -kHalf && y < kHalf && z >= -kHalf && z < kHalf);
  return ((z + kHalf) << (2 * kAxisBits) | (y + kHalf) << kAxisBits | (x + kHalf)) << 6;
}

}  // namespace

std::int64_t row_of(const TileKey& t) {
  return region_row(t.x >> 2, t.y >> 2, t.z >> 2) | (t.x & 3) | (t.y & 3) << 2 | (t.z & 3) << 4;
}

TileKey tile_of(std::int64_t row) {
  constexpr std::int64_t kMask = (std::int64_t{1} << kAxisBits) - 1;
  const auto axis = [&](int shift, int bits) {
    const std::int64_t region = (row >> shift & kMask) - kHalf;
    return static_cast<std::int32_t>(region * 4 + (row >> bits & 3));
  };
  return {axis(6, 0), axis(6 + kAxisBits, 2), axis(6 + 2 * kAxisBits, 4)};
}

std::int64_t first_row_of(const BlockKey& region) {
  return region_row(region.x, region.y, region.z);
}

}  // namespace pocd::memory
