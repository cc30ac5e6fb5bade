#include "gather.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd/map/map_reader.hpp"
#include "voxel_page.hpp"

namespace pocd::memory {
namespace {

/// The rows of the file that blocks are in: by region, so that none is read twice.
std::vector<std::int64_t> rows_of(const std::vector<BlockKey>& blocks) {
  std::vector<std::int64_t> rows;
  rows.reserve(blocks.size());
  for (const BlockKey& key : blocks) rows.push_back(row_of({key.x >> 1, key.y >> 1, key.z >> 1}));
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

}  // namespace

void gather_changes(PocdPipeline& pipeline, const MapPublisher& publisher, MemoryStep& step) {
  step.pieces = pipeline.take_changed_pieces();
  TsdfMap& map = pipeline.map();
  const std::vector<BlockKey> unsaved = map.take_unsaved();
  step.blocks.reserve(unsaved.size() + unsaved.size() / 2);
  MapReader reader(map);
  for (const std::int64_t row : rows_of(unsaved)) {
    TileStep tile;
    tile.key = tile_of(row);
    tile.first = step.blocks.size();
    for (int i = 0; i < 8; ++i) {
      const BlockKey key{2 * tile.key.x + (i & 1), 2 * tile.key.y + (i >> 1 & 1),
                         2 * tile.key.z + (i >> 2)};
      const VoxelBlock* block = nullptr;
      try {
        block = reader.find(key);
      } catch (const InputError&) {  // on disk, and unreadable
        map.recall(key);
        block = reader.find(key);
      }
      if (!block) continue;
      tile.mask = static_cast<std::uint8_t>(tile.mask | 1 << i);
      step.blocks.push_back(*block);
    }
    const auto published = publisher.tiles().find(tile.key);
    if (published != publisher.tiles().end()) {
      tile.version = published->second.version;
      tile.payload = published->second.payload;
    }
    step.tiles.push_back(std::move(tile));
  }
}

}  // namespace pocd::memory
