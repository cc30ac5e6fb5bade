#include "tile_gathering.hpp"

#include <utility>

#include "map_digest.hpp"

namespace pocd {

void TileGathering::put(MapTile tile) {
  const auto [held, fresh] = tiles_.try_emplace(tile.key);
  if (!fresh) {
    if (tile.version < held->second.version) return;
    subtract(sum_, tile_digest(tile.key, held->second.payload));
  }
  add(sum_, tile_digest(tile.key, tile.payload));
  held->second = std::move(tile);
}

void TileGathering::remove(const TileKey& key) {
  const auto held = tiles_.find(key);
  if (held == tiles_.end()) return;
  subtract(sum_, tile_digest(key, held->second.payload));
  tiles_.erase(held);
}

std::vector<MapTile> TileGathering::list() const {
  std::vector<MapTile> tiles;
  tiles.reserve(tiles_.size());
  for (const auto& entry : tiles_) tiles.push_back(entry.second);
  return tiles;
}

}  // namespace pocd
