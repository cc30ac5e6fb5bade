#include "loader.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "../map/zstd_codec.hpp"
#include "pocd/common/check.hpp"
#include "voxel_page.hpp"

namespace pocd::memory {
namespace {

constexpr std::size_t kLargestPiece = 256u << 20;

std::string row_name(const Database& database, const char* table, std::int64_t key) {
  return database.name() + ": row " + std::to_string(key) + " of " + table;
}

}  // namespace

Total read_rows(Database& database, Table table,
                const std::function<void(std::int64_t, std::vector<std::uint8_t>)>& visit,
                const std::function<void(const std::string&)>& damaged) {
  Total total;
  const std::string query =
      std::string("SELECT key, sum, data FROM ") + kTableNames[table] + " ORDER BY key";
  Statement rows(database, query.c_str());
  std::optional<std::int64_t> before;
  while (rows.step()) {
    const std::int64_t key = rows.integer(0);
    if (before && key <= *before) {
      damaged(row_name(database, kTableNames[table], key) + " is out of order");
      break;
    }
    before = key;
    const auto sum = static_cast<std::uint64_t>(rows.integer(1));
    std::vector<std::uint8_t> data = rows.blob(2);
    ++total.rows;
    total.sum += sum;
    if (row_sum(static_cast<std::uint64_t>(key), data.data(), data.size()) != sum) {
      damaged(row_name(database, kTableNames[table], key) + " is damaged");
      continue;
    }
    try {
      visit(key, std::move(data));
    } catch (const InputError& error) {
      damaged(row_name(database, kTableNames[table], key) + ": " + error.what());
    }
  }
  return total;
}

MapTile tile_row(std::int64_t key, std::vector<std::uint8_t> data, const std::string& source) {
  MapTile tile;
  tile.key = tile_of(key);
  if (data.size() <= sizeof tile.version) throw InputError(source + ": is cut short");
  std::memcpy(&tile.version, data.data(), sizeof tile.version);
  data.erase(data.begin(), data.begin() + sizeof tile.version);
  tile.payload = std::move(data);
  return tile;
}

std::pair<std::uint8_t, std::vector<std::uint32_t>> index_row(
    const std::vector<std::uint8_t>& bytes, const std::string& source) {
  std::pair<std::uint8_t, std::vector<std::uint32_t>> row;
  unarchive(bytes, source, row);
  if (row.first == 0) throw InputError(source + ": names no block");
  return row;
}

Loaded load(Database& database, const StoredState& state) {
  Loaded loaded;
  const auto refuse = [](const std::string& reason) { throw InputError(reason); };
  const auto check = [&](Table table, const Total& found) {
    if (found == state.totals[table]) return;
    throw InputError(database.name() + ": " + kTableNames[table] + " has " +
                     std::to_string(found.rows) + " rows that are not the " +
                     std::to_string(state.totals[table].rows) + " of the last step");
  };
  for (const Table table : {kParts, kObjects, kSurfaces, kFreeSpaceTable, kRegionsTable}) {
    check(table, read_rows(
                     database, table,
                     [&](std::int64_t key, std::vector<std::uint8_t> data) {
                       loaded.pieces.push_back(
                           {static_cast<PieceKind>(table),
                            static_cast<std::uint64_t>(key),
                            decompress(data.data(), data.size(), kLargestPiece, "piece"),
                            {}});
                     },
                     refuse));
  }
  check(kTiles, read_rows(
                    database, kTiles,
                    [&](std::int64_t key, std::vector<std::uint8_t> data) {
                      loaded.tiles.push_back(tile_row(key, std::move(data), "tile"));
                    },
                    refuse));
  // The 64 tiles of a region follow each other.
  check(kVoxelIndex, read_rows(
                         database, kVoxelIndex,
                         [&](std::int64_t key, std::vector<std::uint8_t> data) {
                           const auto [mask, owners] = index_row(data, "index");
                           const TileKey tile = tile_of(key);
                           const BlockKey region{tile.x >> 2, tile.y >> 2, tile.z >> 2};
                           if (loaded.regions.empty() || !(loaded.regions.back().key == region)) {
                             loaded.regions.push_back({region, {}, {}});
                           }
                           StoredRegion& stored = loaded.regions.back();
                           for (int i = 0; i < 8; ++i) {
                             if (!(mask >> i & 1)) continue;
                             const int x = 2 * (tile.x & 3) + (i & 1),
                                       y = 2 * (tile.y & 3) + (i >> 1 & 1),
                                       z = 2 * (tile.z & 3) + (i >> 2);
                             stored.present.set(static_cast<std::size_t>(x + 8 * (y + 8 * z)));
                           }
                           for (const std::uint32_t owner : owners) {
                             auto& all = stored.owners;
                             if (std::find(all.begin(), all.end(), owner) == all.end())
                               all.push_back(owner);
                           }
                         },
                         refuse));
  return loaded;
}

VoxelsOf::VoxelsOf(Database& database)
    : database_(database),
      rows_(database_,
            "SELECT i.key, i.data, v.sum, v.data, t.sum, t.data FROM voxel_index i "
            "LEFT JOIN voxels v ON v.key = i.key LEFT JOIN tiles t ON t.key = i.key "
            "WHERE i.key BETWEEN ?1 AND ?2 ORDER BY i.key") {}

std::vector<VoxelBlock> VoxelsOf::read(const BlockKey& region) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<BlockKey, VoxelBlock> blocks;
  const std::int64_t first = first_row_of(region);
  try {
    rows_.bind(1, first).bind(2, first + 63);
    while (rows_.step()) {
      const std::int64_t key = rows_.integer(0);
      const std::string source = row_name(database_, "voxels", key);
      const auto mask = index_row(rows_.blob(1), source).first;
      // Column of the sum; the bytes follow it.
      const auto checked = [&](int column, const std::string& name) {
        std::vector<std::uint8_t> data = rows_.blob(column + 1);
        if (static_cast<std::uint64_t>(rows_.integer(column)) !=
            row_sum(static_cast<std::uint64_t>(key), data.data(), data.size())) {
          throw InputError(name + " is damaged");
        }
        return data;
      };
      std::vector<std::uint8_t> published;
      if (rows_.has(5)) {
        const std::string name = row_name(database_, "tiles", key);
        published = tile_row(key, checked(4, name), name).payload.bytes();
      }
      std::vector<VoxelBlock> tile;
      decode_voxels(tile_of(key), mask, checked(2, source), published, source, tile);
      for (const VoxelBlock& block : tile) blocks[block.key] = block;
    }
  } catch (const DatabaseError& error) {
    rows_.reset();
    throw InputError(error.what());
  } catch (const InputError&) {
    rows_.reset();
    throw;
  }
  rows_.reset();  // ends the read transaction
  std::vector<VoxelBlock> list;
  list.reserve(blocks.size());
  for (const auto& entry : blocks) list.push_back(entry.second);
  return list;
}

}  // namespace pocd::memory
