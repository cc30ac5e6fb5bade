// The tiles of one run of a publisher as they come, one by one and in any order, and whether
// together they are a map that it said it had.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd {

/// Holds the newest state heard of every tile and the running sum of their digests. Not
/// thread-safe.
class TileGathering {
 public:
  /// One older than what is held of that tile is ignored.
  void put(MapTile tile);
  void remove(const TileKey& key);
  bool has_sum(const MapDigest& digest) const { return sum_ == digest; }
  std::size_t size() const { return tiles_.size(); }
  const MapDigest& digest() const { return sum_; }
  /// Canonical order.
  std::vector<MapTile> list() const;

 private:
  std::map<TileKey, MapTile> tiles_;
  MapDigest sum_;
};

}  // namespace pocd
