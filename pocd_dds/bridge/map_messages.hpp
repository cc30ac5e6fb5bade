// Tiles, steps and snapshots of the map as messages, and back.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pocd/map/map_follower.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_msgs.h"

namespace pocd::dds {

/// The region of the map that a tile lies in.
inline BlockKey region_of(const TileKey& tile) {
  return BlockKey{2 * tile.x, 2 * tile.y, 2 * tile.z}.region();
}

pocd_msgs::msg::MapTile tile_message(const MapTile& tile, std::uint32_t map_id,
                                     std::uint64_t epoch);
/// CRC of the payload does not fit it: nothing.
std::optional<MapTile> tile_from(const pocd_msgs::msg::MapTile& message);

/// What is cut into messages of at most about `part_bytes` of payload each. Each is made when it is
/// wanted; until then there is a view of the tiles, which shares their bytes.
template <class Message>
class Parts {
 public:
  /// `head` is what all of them say. The keys go before the tiles.
  Parts(Message head, std::vector<TileKey> keys, std::vector<MapTile> tiles,
        std::size_t part_bytes);

  std::size_t left() const { return ends_.size() - made_; }
  /// One after the other; only while some are left().
  Message next();

 private:
  struct End {
    std::size_t key, tile;
  };
  Message head_;
  std::vector<TileKey> keys_;
  std::vector<MapTile> tiles_;
  std::vector<End> ends_;  // of each part
  std::size_t made_ = 0;
};

/// One step of the map.
using DeltaParts = Parts<pocd_msgs::msg::MapDelta>;
DeltaParts delta_parts(MapDelta delta, std::uint32_t map_id, StampNs stamp_ns,
                       std::size_t part_bytes);
/// The step that all its parts (in order, complete) make; nothing when a CRC does not fit.
std::optional<MapDelta> delta_from(const std::vector<pocd_msgs::msg::MapDelta>& parts);

/// Every tile newer than `base_version`, as it is now, and the keys of all.
using SnapshotParts = Parts<pocd_msgs::msg::MapSnapshotReply>;
SnapshotParts snapshot_parts(const MapPublisher& publisher, std::uint64_t base_version,
                             std::uint32_t map_id, std::size_t part_bytes);
/// Without tiles and keys.
MapSnapshot snapshot_header(const pocd_msgs::msg::MapSnapshotReply& message);
/// What all parts (in order, complete) make; nothing when a CRC does not fit.
std::optional<MapSnapshot> snapshot_from(
    const std::vector<pocd_msgs::msg::MapSnapshotReply>& parts);

TileKey key_from(const pocd_msgs::msg::TileKey& key);
std::optional<MapTile> tile_from(const pocd_msgs::msg::TileData& data);
MapDigest digest_from(const pocd_msgs::msg::MapDigest& digest);
pocd_msgs::msg::MapDigest digest_message(const MapDigest& digest);

}  // namespace pocd::dds
