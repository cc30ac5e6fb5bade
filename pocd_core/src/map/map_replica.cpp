#include "pocd/map/map_replica.hpp"

#include <algorithm>

#include "map_digest.hpp"

namespace pocd {

MapDigest map_digest(const std::vector<MapTile>& tiles) {
  MapDigest sum;
  for (const MapTile& tile : tiles) add(sum, tile_digest(tile.key, tile.payload));
  return sum;
}

void MapReplica::hear(std::uint64_t epoch, std::uint64_t version) {
  if (epoch == *epoch_) {
    newest_ = std::max(newest_, version);
  } else {
    other_newest_ = other_epoch_ == epoch ? std::max(other_newest_, version) : version;
    other_epoch_ = epoch;
  }
}

DeltaOutcome MapReplica::apply(const MapDelta& delta) {
  if (!epoch_) epoch_ = delta.epoch;
  hear(delta.epoch, delta.version);
  if (delta.epoch != *epoch_) return DeltaOutcome::kWrongEpoch;
  if (corrupt_) return DeltaOutcome::kCorrupt;
  if (delta.version <= version_) return DeltaOutcome::kOld;
  if (delta.base_version != version_) return DeltaOutcome::kGap;

  for (const TileKey& key : delta.removed) {
    const auto known = tiles_.find(key);
    if (known == tiles_.end()) continue;  // the digest below tells whether that matters
    subtract(digest_, tile_digest(key, known->second.payload));
    tiles_.erase(known);
  }
  for (const MapTile& tile : delta.changed) {
    const auto [mine, fresh] = tiles_.try_emplace(tile.key);
    if (!fresh) subtract(digest_, tile_digest(tile.key, mine->second.payload));
    add(digest_, tile_digest(tile.key, tile.payload));
    mine->second = tile;
  }
  version_ = delta.version;
  corrupt_ = digest_ != delta.digest;
  return corrupt_ ? DeltaOutcome::kCorrupt : DeltaOutcome::kApplied;
}

void MapReplica::note_published(std::uint64_t epoch, std::uint64_t version,
                                const MapDigest& digest) {
  if (!epoch_) epoch_ = epoch;
  if (epoch != *epoch_ && !corrupt_ && version > 0 && version == version_ && digest == digest_) {
    epoch_ = epoch;
    newest_ = other_epoch_ == epoch ? other_newest_ : 0;
  }
  if (epoch == *epoch_) other_epoch_.reset();  // the publisher has the last word on its run
  hear(epoch, version);
  if (epoch == *epoch_ && version == version_ && digest != digest_) corrupt_ = true;
}

bool MapReplica::replace(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest,
                         std::vector<MapTile> tiles) {
  const bool same_run = epoch_ && *epoch_ == epoch;
  if (same_run && version < version_ && !corrupt_) return false;
  std::map<TileKey, MapTile> by_key;
  for (MapTile& tile : tiles) {
    const TileKey key = tile.key;
    by_key[key] = std::move(tile);
  }
  MapDigest sum;
  for (const auto& [key, tile] : by_key) add(sum, tile_digest(key, tile.payload));
  if (sum != digest) return false;
  if (!same_run) newest_ = other_epoch_ == epoch ? other_newest_ : 0;
  newest_ = std::max(newest_, version);
  epoch_ = epoch;
  other_epoch_.reset();
  version_ = version;
  corrupt_ = false;
  digest_ = sum;
  tiles_ = std::move(by_key);
  return true;
}

std::string MapReplica::stale_because() const {
  if (!epoch_) return "nothing received yet";
  if (other_epoch_) {
    return "the publisher runs in epoch " + std::to_string(*other_epoch_) +
           ", this copy is of epoch " + std::to_string(*epoch_);
  }
  if (corrupt_) return "the digest of version " + std::to_string(version_) + " does not fit";
  if (version_ != newest_) {
    return "at version " + std::to_string(version_) + ", the publisher is at " +
           std::to_string(newest_);
  }
  return "";
}

}  // namespace pocd
