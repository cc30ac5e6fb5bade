#include "pocd_dds/bridge/map_messages.hpp"

#include <boost/crc.hpp>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd::dds {
namespace {

constexpr std::size_t kKeyBytes = 12;  // of a tile, on the wire

pocd_msgs::msg::TileKey key_of(const TileKey& key) {
  pocd_msgs::msg::TileKey message;
  message.x(key.x), message.y(key.y), message.z(key.z);
  return message;
}

std::uint32_t crc_of(const std::vector<std::uint8_t>& payload) {
  boost::crc_32_type crc;
  crc.process_bytes(payload.data(), payload.size());
  return crc.checksum();
}

pocd_msgs::msg::TileData data_of(const MapTile& tile) {
  pocd_msgs::msg::TileData data;
  data.key(key_of(tile.key));
  data.version(tile.version);
  data.crc(crc_of(tile.payload));
  data.payload(tile.payload.bytes());
  return data;
}

std::vector<pocd_msgs::msg::TileKey>& keys_of(pocd_msgs::msg::MapDelta& message) {
  return message.removed();
}
std::vector<pocd_msgs::msg::TileKey>& keys_of(pocd_msgs::msg::MapSnapshotReply& message) {
  return message.present();
}

/// All tiles that the parts bring; nothing when a CRC does not fit.
template <class Message>
std::optional<std::vector<MapTile>> tiles_from(const std::vector<Message>& parts) {
  std::vector<MapTile> tiles;
  for (const Message& part : parts) {
    for (const auto& data : part.changed()) {
      std::optional<MapTile> tile = tile_from(data);
      if (!tile) return std::nullopt;
      tiles.push_back(std::move(*tile));
    }
  }
  return tiles;
}

}  // namespace

pocd_msgs::msg::MapTile tile_message(const MapTile& tile, std::uint32_t map_id,
                                     std::uint64_t epoch) {
  pocd_msgs::msg::MapTile message;
  message.map_id(map_id);
  message.x(tile.key.x), message.y(tile.key.y), message.z(tile.key.z);
  message.epoch(epoch);
  message.version(tile.version);
  message.crc(crc_of(tile.payload));
  message.payload(tile.payload.bytes());
  return message;
}

std::optional<MapTile> tile_from(const pocd_msgs::msg::MapTile& message) {
  if (crc_of(message.payload()) != message.crc()) return std::nullopt;
  return MapTile{{message.x(), message.y(), message.z()}, message.version(), message.payload()};
}

std::optional<MapTile> tile_from(const pocd_msgs::msg::TileData& data) {
  if (crc_of(data.payload()) != data.crc()) return std::nullopt;
  return MapTile{key_from(data.key()), data.version(), data.payload()};
}

template <class Message>
Parts<Message>::Parts(Message head, std::vector<TileKey> keys, std::vector<MapTile> tiles,
                      std::size_t part_bytes)
    : head_(std::move(head)), keys_(std::move(keys)), tiles_(std::move(tiles)) {
  const std::size_t most_keys = part_bytes / kKeyBytes;
  End end{0, 0};
  while (keys_.size() - end.key > most_keys) {
    end.key += most_keys;
    ends_.push_back(end);
  }
  std::size_t bytes = (keys_.size() - end.key) * kKeyBytes;
  end.key = keys_.size();
  for (; end.tile < tiles_.size(); ++end.tile) {
    const std::size_t more = tiles_[end.tile].payload.size();
    if (bytes > 0 && bytes + more > part_bytes) {
      ends_.push_back(end);
      bytes = 0;
    }
    bytes += more;
  }
  ends_.push_back(end);
}

template <class Message>
Message Parts<Message>::next() {
  POCD_CHECK(left() > 0);
  const End begin = made_ == 0 ? End{0, 0} : ends_[made_ - 1], end = ends_[made_];
  Message message = head_;
  message.part(static_cast<std::uint32_t>(made_++));
  message.part_count(static_cast<std::uint32_t>(ends_.size()));
  for (std::size_t i = begin.key; i < end.key; ++i) keys_of(message).push_back(key_of(keys_[i]));
  for (std::size_t i = begin.tile; i < end.tile; ++i) {
    message.changed().push_back(data_of(tiles_[i]));
  }
  return message;
}

template class Parts<pocd_msgs::msg::MapDelta>;
template class Parts<pocd_msgs::msg::MapSnapshotReply>;

DeltaParts delta_parts(MapDelta delta, std::uint32_t map_id, StampNs stamp_ns,
                       std::size_t part_bytes) {
  pocd_msgs::msg::MapDelta head;
  head.map_id(map_id);
  head.epoch(delta.epoch);
  head.base_version(delta.base_version);
  head.version(delta.version);
  head.stamp(to_time(stamp_ns));
  head.digest(digest_message(delta.digest));
  return {std::move(head), std::move(delta.removed), std::move(delta.changed), part_bytes};
}

std::optional<MapDelta> delta_from(const std::vector<pocd_msgs::msg::MapDelta>& parts) {
  POCD_CHECK(!parts.empty());
  std::optional<std::vector<MapTile>> changed = tiles_from(parts);
  if (!changed) return std::nullopt;
  MapDelta delta;
  delta.epoch = parts.front().epoch();
  delta.base_version = parts.front().base_version();
  delta.version = parts.front().version();
  delta.digest = digest_from(parts.front().digest());
  delta.changed = std::move(*changed);
  for (const auto& part : parts) {
    for (const auto& key : part.removed()) delta.removed.push_back(key_from(key));
  }
  return delta;
}

SnapshotParts snapshot_parts(const MapPublisher& publisher, std::uint64_t base_version,
                             std::uint32_t map_id, std::size_t part_bytes) {
  pocd_msgs::msg::MapSnapshotReply head;
  head.map_id(map_id);
  head.epoch(publisher.epoch());
  head.base_version(base_version);
  head.version(publisher.version());
  head.digest(digest_message(publisher.digest()));
  std::vector<TileKey> present;
  std::vector<MapTile> changed;
  present.reserve(publisher.tiles().size());
  for (const auto& [key, tile] : publisher.tiles()) {
    present.push_back(key);
    if (tile.version > base_version) changed.push_back(tile);
  }
  return {std::move(head), std::move(present), std::move(changed), part_bytes};
}

MapSnapshot snapshot_header(const pocd_msgs::msg::MapSnapshotReply& message) {
  MapSnapshot snapshot;
  snapshot.epoch = message.epoch();
  snapshot.base_version = message.base_version();
  snapshot.version = message.version();
  snapshot.digest = digest_from(message.digest());
  return snapshot;
}

std::optional<MapSnapshot> snapshot_from(
    const std::vector<pocd_msgs::msg::MapSnapshotReply>& parts) {
  POCD_CHECK(!parts.empty());
  std::optional<std::vector<MapTile>> changed = tiles_from(parts);
  if (!changed) return std::nullopt;
  MapSnapshot snapshot = snapshot_header(parts.front());
  snapshot.changed = std::move(*changed);
  for (const auto& part : parts) {
    for (const auto& key : part.present()) snapshot.present.push_back(key_from(key));
  }
  return snapshot;
}

TileKey key_from(const pocd_msgs::msg::TileKey& key) { return {key.x(), key.y(), key.z()}; }

MapDigest digest_from(const pocd_msgs::msg::MapDigest& digest) {
  MapDigest result;
  result.low = digest.low();
  result.high = digest.high();
  return result;
}

pocd_msgs::msg::MapDigest digest_message(const MapDigest& digest) {
  pocd_msgs::msg::MapDigest message;
  message.low(digest.low);
  message.high(digest.high);
  return message;
}

}  // namespace pocd::dds
