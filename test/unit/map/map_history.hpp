// A publisher of made-up tiles that remembers what its map was at every version.
#pragma once

#include <map>
#include <vector>

#include "pocd/common/random.hpp"
#include "pocd/map/map_replica.hpp"

namespace pocd::testing {

inline MapTile random_tile(Random& random, std::uint64_t version) {
  const auto c = [&random] { return static_cast<std::int32_t>(random.below(3)) - 1; };
  MapTile tile;
  tile.key = {c(), c(), c()};
  tile.version = version;
  std::vector<std::uint8_t> payload(1 + random.below(20));
  for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random.next());
  tile.payload = std::move(payload);
  return tile;
}

/// As if it had been damaged on the way.
inline void lengthen(MapTile& tile) {
  std::vector<std::uint8_t> payload = tile.payload.bytes();
  payload.push_back(1);
  tile.payload = std::move(payload);
}

using Contents = std::map<TileKey, std::vector<std::uint8_t>>;

template <class Tiles>
Contents contents(const Tiles& tiles) {
  Contents out;
  for (const auto& [key, tile] : tiles) out[key] = tile.payload.bytes();
  return out;
}

struct History {
  std::vector<MapDelta> deltas;                     // from version i to i + 1
  std::vector<std::map<TileKey, MapTile>> maps{1};  // at version i

  History(Random& random, std::uint64_t epoch, int length) {
    for (int v = 1; v <= length; ++v) {
      std::map<TileKey, MapTile> now = maps.back();
      MapDelta delta;
      delta.epoch = epoch;
      delta.base_version = static_cast<std::uint64_t>(v) - 1;
      delta.version = static_cast<std::uint64_t>(v);
      if (!now.empty() && random.uniform() < 0.4) {
        delta.removed.push_back(now.begin()->first);
        now.erase(now.begin());
      }
      const MapTile tile = random_tile(random, delta.version);
      if (delta.removed.empty() || !(delta.removed[0] == tile.key)) {
        now[tile.key] = tile;
        delta.changed.push_back(tile);
      }
      delta.digest = digest(now);
      deltas.push_back(delta);
      maps.push_back(now);
    }
  }
  static std::vector<MapTile> list(const std::map<TileKey, MapTile>& map) {
    std::vector<MapTile> tiles;
    for (const auto& entry : map) tiles.push_back(entry.second);
    return tiles;
  }
  static MapDigest digest(const std::map<TileKey, MapTile>& map) { return map_digest(list(map)); }
};

}  // namespace pocd::testing
