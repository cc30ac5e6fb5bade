// Layout, inside one zstd frame, for the n blocks of the mask after each other (512 n voxels). Only
// voxels that are not all 0 are listed, in order. The published tile, where there is one, says most
// of which they are and of their distances. Numbers are what is left of them, modulo 2^16, zigzag:
// 0, -1, 1, -2, ... Each line is a section, compressed by itself: what is random in one of them
// would spoil the code of the others.
//   u32 number m of voxels that are listed; 512 n bits, bit i % 8 of byte i / 8, of those that are
//   listed and not observed in the tile, or the other way round
//   distances less that of the tile, or where it has none that of the voxel before, low bytes
//   the same, high bytes
//   weights less that of the voxel before, low bytes
//   the same, high bytes
//   u32 number p of owners, p x u32 owners, ascending, then per voxel the index: 0 background, k
//   owner k-1; absent if p = 0, u8 if p < 256, else u16, low bytes, then high bytes
#include "voxel_page.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>

#include "../map/zstd_codec.hpp"
#include "pocd/common/check.hpp"

namespace pocd::memory {
namespace {

constexpr int kVoxels = VoxelBlock::kVoxels;
constexpr int kLevel = 1;
constexpr std::size_t kLargest = 8 * kVoxels * (2 + 2 + 2 + 4) + 8 * kVoxels / 8 + 8;

std::uint16_t zigzag(std::uint16_t difference) {
  const auto sign = static_cast<std::uint16_t>(difference >> 15 ? 0xFFFF : 0);
  return static_cast<std::uint16_t>(difference << 1 ^ sign);
}
std::uint16_t unzigzag(unsigned value) {
  return static_cast<std::uint16_t>(value >> 1 ^ (value & 1 ? 0xFFFF : 0));
}

/// Collects bytes and where their sections end.
class Sections {
 public:
  explicit Sections(std::size_t size) { raw_.reserve(size); }
  void byte(unsigned v) { raw_.push_back(static_cast<std::uint8_t>(v)); }
  void number(std::uint32_t v) {
    for (int i = 0; i < 4; ++i) byte(v >> (8 * i) & 0xFF);
  }
  void end() { ends_.push_back(raw_.size()); }
  /// Low bytes, then high bytes.
  void planes(const std::vector<std::uint16_t>& values) {
    for (const std::uint16_t v : values) byte(v & 0xFF);
    end();
    for (const std::uint16_t v : values) byte(v >> 8);
    end();
  }
  std::vector<std::uint8_t> compressed() const { return compress(raw_, kLevel, ends_); }

 private:
  std::vector<std::uint8_t> raw_;
  std::vector<std::size_t> ends_;
};

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
  std::uint32_t number() {
    std::uint32_t v = 0;
    std::memcpy(&v, take(4), 4);
    return v;
  }
  void finish() const {
    if (at_ != bytes_.size()) throw InputError(source_ + ": bytes after the voxels");
  }

 private:
  const std::vector<std::uint8_t>& bytes_;
  const std::string& source_;
  std::size_t at_ = 0;
};

void put_owners(const std::vector<std::uint32_t>& palette, const std::vector<std::uint32_t>& owners,
                Sections& out) {
  out.number(static_cast<std::uint32_t>(palette.size()));
  for (const std::uint32_t owner : palette) out.number(owner);
  if (palette.empty()) return;
  std::vector<std::uint16_t> indices;
  indices.reserve(owners.size());
  std::uint32_t last = 0;
  std::uint16_t index = 0;
  for (const std::uint32_t owner : owners) {
    if (owner != last) {
      last = owner;
      const auto at = std::lower_bound(palette.begin(), palette.end(), owner);
      index = owner == 0 ? 0 : static_cast<std::uint16_t>(at - palette.begin() + 1);
    }
    indices.push_back(index);
  }
  if (palette.size() < 256) {
    for (const std::uint16_t v : indices) out.byte(v);
  } else {
    out.planes(indices);
  }
}

/// What the published tile says of the voxels of a page.
class Guess {
 public:
  explicit Guess(const std::vector<std::uint8_t>& payload) {
    constexpr double kSteps = 127.0;  // as the tile counts distances
    if (!payload.empty()) tile_ = std::make_unique<DecodedTile>(decode_tile(payload, kSteps));
  }
  /// Voxel i of the block in this place.
  bool observed(int place, int i) const {
    return tile_ != nullptr && tile_->observed[index(place, i)] != 0;
  }
  /// Of one that is observed.
  std::uint16_t distance(int place, int i) const {
    const auto step = static_cast<int>(tile_->distance_m[index(place, i)]);
    return static_cast<std::uint16_t>(step * 32767 / 127);
  }

 private:
  static std::size_t index(int place, int i) {
    const int x = (place & 1) * 8 + (i & 7), y = (place >> 1 & 1) * 8 + (i >> 3 & 7),
              z = (place >> 2) * 8 + (i >> 6);
    return static_cast<std::size_t>(x + kTileSide * (y + kTileSide * z));
  }
  std::unique_ptr<const DecodedTile> tile_;
};

/// Calls `visit(place, i, v)` for voxel i of each block of the mask; v counts them.
template <class Visit>
void for_each_voxel(std::uint8_t mask, const Visit& visit) {
  std::size_t v = 0;
  for (int place = 0; place < 8; ++place) {
    if (!(mask >> place & 1)) continue;
    for (int i = 0; i < kVoxels; ++i, ++v) visit(place, i, v);
  }
}

}  // namespace

VoxelPage encode_voxels(std::uint8_t mask, const VoxelBlock* blocks,
                        const std::vector<std::uint8_t>& published) {
  const auto n = static_cast<std::size_t>(__builtin_popcount(mask)) * kVoxels;
  const Guess guess(published);
  VoxelPage page;
  page.mask = mask;
  std::vector<std::uint8_t> unforeseen(n / 8, 0);
  std::vector<std::uint16_t> distances, weights;
  std::vector<std::uint32_t> owners;
  distances.reserve(n), weights.reserve(n), owners.reserve(n);
  std::uint16_t distance = 0, weight = 0;
  for_each_voxel(mask, [&](int place, int i, std::size_t v) {
    const VoxelBlock& block = blocks[v / kVoxels];
    const auto tsdf = static_cast<std::uint16_t>(block.tsdf[i]);
    const std::uint32_t owner = block.owner[i];
    const bool listed = tsdf != 0 || block.weight[i] != 0 || owner != 0;
    const bool observed = guess.observed(place, i);
    if (listed != observed) {
      unforeseen[v / 8] = static_cast<std::uint8_t>(unforeseen[v / 8] | 1 << (v % 8));
    }
    if (!listed) return;
    const std::uint16_t expected = observed ? guess.distance(place, i) : distance;
    distances.push_back(zigzag(static_cast<std::uint16_t>(tsdf - expected)));
    weights.push_back(zigzag(static_cast<std::uint16_t>(block.weight[i] - weight)));
    if (owner != 0 && (owners.empty() || owner != owners.back())) page.owners.push_back(owner);
    owners.push_back(owner);
    distance = tsdf;
    weight = block.weight[i];
  });
  std::sort(page.owners.begin(), page.owners.end());
  page.owners.erase(std::unique(page.owners.begin(), page.owners.end()), page.owners.end());
  Sections out(n * 5 + n / 8 + 64);
  out.number(static_cast<std::uint32_t>(distances.size()));
  for (const std::uint8_t bits : unforeseen) out.byte(bits);
  out.end();
  out.planes(distances);
  out.planes(weights);
  put_owners(page.owners, owners, out);
  page.bytes = out.compressed();
  return page;
}

void decode_voxels(const TileKey& key, std::uint8_t mask, const std::vector<std::uint8_t>& bytes,
                   const std::vector<std::uint8_t>& published, const std::string& source,
                   std::vector<VoxelBlock>& out) {
  const std::vector<std::uint8_t> raw = decompress(bytes.data(), bytes.size(), kLargest, source);
  const auto n = static_cast<std::size_t>(__builtin_popcount(mask)) * kVoxels;
  const Guess guess(published);
  Bytes in(raw, source);
  const std::size_t m = in.number();
  const std::uint8_t* unforeseen = in.take(n / 8);
  if (m > n) throw InputError(source + ": lists more voxels than there are");
  const std::uint8_t* distances = in.take(2 * m);
  const std::uint8_t* weights = in.take(2 * m);
  const std::size_t p = in.number();
  if (p > n) throw InputError(source + ": more owners than voxels");
  std::vector<std::uint32_t> owners(p + 1, 0);
  std::memcpy(owners.data() + 1, in.take(4 * p), 4 * p);
  const std::uint8_t* index = p == 0 ? nullptr : in.take(p < 256 ? m : 2 * m);
  in.finish();
  std::uint16_t distance = 0, weight = 0;
  std::size_t k = 0;  // of those that are listed
  const std::size_t first = out.size();
  for_each_voxel(mask, [&](int place, int i, std::size_t v) {
    if (i == 0) {
      out.emplace_back().key = {2 * key.x + (place & 1), 2 * key.y + (place >> 1 & 1),
                                2 * key.z + (place >> 2)};
    }
    const bool observed = guess.observed(place, i);
    if (observed == ((unforeseen[v / 8] >> (v % 8) & 1) != 0)) return;
    if (k == m) throw InputError(source + ": lists fewer voxels than it names");
    VoxelBlock& block = out[first + v / kVoxels];
    const std::uint16_t expected = observed ? guess.distance(place, i) : distance;
    distance =
        static_cast<std::uint16_t>(expected + unzigzag(distances[k] | distances[m + k] << 8));
    weight = static_cast<std::uint16_t>(weight + unzigzag(weights[k] | weights[m + k] << 8));
    block.tsdf[i] = static_cast<std::int16_t>(distance);
    block.weight[i] = weight;
    if (p > 0) {
      const std::size_t o =
          p < 256 ? index[k] : static_cast<std::size_t>(index[k] | index[m + k] << 8);
      if (o > p) throw InputError(source + ": a voxel has an owner that is not listed");
      block.owner[i] = owners[o];
    }
    ++k;
  });
  if (k != m) throw InputError(source + ": lists more voxels than it names");
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
