// Reading the whole map, whatever part of it is on disk.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "pocd/map/tsdf_map.hpp"

namespace pocd {

/// Looks at blocks without changing what is in memory. Several readers may work beside each other
/// while nobody changes the map. It keeps a few regions that it has read from disk: walk through
/// the keys region by region (TsdfMap::keys_by_region), and none is read twice.
class MapReader {
 public:
  explicit MapReader(const TsdfMap& map) : map_(map) {}

  /// Null where nothing is allocated. Valid until the next change of the map, and, for a block on
  /// disk, until blocks of kPages other regions were asked for. Throws InputError when the block
  /// cannot be read from disk.
  const VoxelBlock* find(const BlockKey& key);
  static constexpr std::size_t kPages = 16;

 private:
  struct Page {
    BlockKey region;
    std::vector<VoxelBlock> blocks;  // by key
  };

  const TsdfMap& map_;
  std::vector<std::unique_ptr<Page>> pages_;
  std::size_t oldest_ = 0;  // of pages_, once there are kPages
};

}  // namespace pocd
