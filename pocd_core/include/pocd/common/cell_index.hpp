// A flat hash from cells of a grid in space to small numbers.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

namespace pocd {

/// Cell (x, y, z) as one number: 21 bits per axis, +-1 million cells, 50 km at 5 cm.
inline std::uint64_t cell_key(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::int64_t kBias = 1 << 20;
  constexpr std::int64_t kMask = 0x1FFFFF;
  return static_cast<std::uint64_t>((x + kBias) & kMask) |
         static_cast<std::uint64_t>((y + kBias) & kMask) << 21 |
         static_cast<std::uint64_t>((z + kBias) & kMask) << 42;
}

/// The cell of a point in a grid with cells of 1 / inverse_m metres.
inline std::uint64_t cell_key(const Eigen::Vector3f& p, float inverse_m) {
  const auto cell = [&](float v) { return static_cast<std::int64_t>(std::floor(v * inverse_m)); };
  return cell_key(cell(p.x()), cell(p.y()), cell(p.z()));
}

/// Open addressing with linear probing, at most half full. Keeps its memory when cleared. Look-up
/// only: the order of the entries is nobody's business.
class CellIndex {
 public:
  static constexpr std::int32_t kNone = -1;

  void clear() {
    for (Entry& e : entries_) e.value = kNone;
    size_ = 0;
  }
  std::int32_t find(std::uint64_t key) const {
    if (entries_.empty()) return kNone;
    return entries_[probe(key)].value;
  }
  /// Enters value >= 0 where the key has none; returns the key's value.
  std::int32_t insert(std::uint64_t key, std::int32_t value) {
    if (2 * (size_ + 1) > entries_.size()) grow();
    Entry& e = entries_[probe(key)];
    if (e.value != kNone) return e.value;
    e = {key, value};
    ++size_;
    return value;
  }
  std::size_t size() const { return size_; }

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::int32_t value = kNone;
  };

  std::size_t probe(std::uint64_t key) const {
    const std::size_t mask = entries_.size() - 1;
    std::size_t i = (key * 0x9E3779B97F4A7C15ull) >> shift_;
    while (entries_[i].value != kNone && entries_[i].key != key) i = (i + 1) & mask;
    return i;
  }
  void grow() {
    std::vector<Entry> old(entries_.empty() ? 64 : 2 * entries_.size());
    old.swap(entries_);
    shift_ = entries_.size() == 64 ? 58 : shift_ - 1;
    for (const Entry& e : old) {
      if (e.value != kNone) entries_[probe(e.key)] = e;
    }
  }

  std::vector<Entry> entries_;  // a power of two of them
  std::size_t size_ = 0;
  int shift_ = 64;  // 64 - log2(entries)
};

}  // namespace pocd
