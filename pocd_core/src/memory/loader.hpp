// Reads what a file holds, and checks it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "database.hpp"
#include "pocd/map/region_source.hpp"
#include "stored_state.hpp"

namespace pocd::memory {

/// Everything that a pipeline and a publisher go on from; voxels are read later.
struct Loaded {
  std::vector<Piece> pieces;
  std::vector<MapTile> tiles;
  std::vector<StoredRegion> regions;
};

/// Throws InputError naming table and key for a row that is damaged, and naming the table when rows
/// are missing or of another time.
Loaded load(Database& database, const StoredState& state);

/// Visits key and bytes of every row, checked; returns what all have together. A damaged row is
/// given to `damaged`, with the reason.
Total read_rows(Database& database, Table table,
                const std::function<void(std::int64_t, std::vector<std::uint8_t>)>& visit,
                const std::function<void(const std::string&)>& damaged);

/// A row of the tiles. Throws InputError naming `source`.
MapTile tile_row(std::int64_t key, std::vector<std::uint8_t> data, const std::string& source);

/// Mask and owners of a row of the voxel index.
std::pair<std::uint8_t, std::vector<std::uint32_t>> index_row(
    const std::vector<std::uint8_t>& bytes, const std::string& source);

/// Voxels by a connection of others, as that one sees them.
class VoxelsOf : public RegionSource {
 public:
  explicit VoxelsOf(Database& database);
  std::vector<VoxelBlock> read(const BlockKey& region) const override;

 private:
  mutable std::mutex mutex_;
  Database& database_;
  mutable Statement rows_;
};

/// Voxels by a connection of its own. What is written to the file meanwhile is not asked for: it
/// has been read before.
class StoredVoxels : public RegionSource {
 public:
  explicit StoredVoxels(const std::filesystem::path& file)
      : database_(file, Database::Access::kRead), voxels_(database_) {}
  std::vector<VoxelBlock> read(const BlockKey& region) const override {
    return voxels_.read(region);
  }

 private:
  Database database_;
  VoxelsOf voxels_;
};

}  // namespace pocd::memory
