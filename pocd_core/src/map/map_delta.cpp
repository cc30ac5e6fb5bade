#include "pocd/map/map_delta.hpp"

// Inlined, because the library's version of the algorithm must not change under a digest.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstdio>

#include "bytes.hpp"
#include "map_digest.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_reader.hpp"
#include "tile_codec.hpp"

namespace pocd {
namespace {

// A tile lies within one region; those of a region follow each other, so that what is on disk is
// read once.
std::vector<TileKey> tiles_of(const std::vector<BlockKey>& blocks) {
  std::vector<TileKey> tiles;
  tiles.reserve(blocks.size());
  for (const BlockKey& key : blocks) tiles.push_back({key.x >> 1, key.y >> 1, key.z >> 1});
  const auto region = [](const TileKey& t) { return BlockKey{2 * t.x, 2 * t.y, 2 * t.z}.region(); };
  std::sort(tiles.begin(), tiles.end(), [&](const TileKey& a, const TileKey& b) {
    const BlockKey ra = region(a), rb = region(b);
    return ra == rb ? a < b : ra < rb;
  });
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  return tiles;
}

std::vector<std::uint8_t> encode(MapReader& map, const TileKey& key, int min_weight) {
  std::array<const VoxelBlock*, 8> blocks;
  for (int i = 0; i < 8; ++i) {
    blocks[i] = map.find({2 * key.x + (i & 1), 2 * key.y + (i >> 1 & 1), 2 * key.z + (i >> 2)});
  }
  return encode_tile(blocks, min_weight);
}

}  // namespace

std::string MapDigest::hex() const {
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(high),
                static_cast<unsigned long long>(low));
  return text;
}

MapDigest tile_digest(const TileKey& key, const std::vector<std::uint8_t>& payload) {
  std::vector<std::uint8_t> head;
  for (const std::int32_t c : {key.x, key.y, key.z}) put(head, static_cast<std::uint32_t>(c));
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_128bits_reset(&state);
  XXH3_128bits_update(&state, head.data(), head.size());
  XXH3_128bits_update(&state, payload.data(), payload.size());
  const XXH128_hash_t hash = XXH3_128bits_digest(&state);
  return {hash.low64, hash.high64};
}

void add(MapDigest& sum, const MapDigest& term) {
  sum.low += term.low;
  sum.high += term.high + (sum.low < term.low ? 1 : 0);
}

void subtract(MapDigest& sum, const MapDigest& term) {
  sum.high -= term.high + (sum.low < term.low ? 1 : 0);
  sum.low -= term.low;
}

MapPublisher::MapPublisher(std::uint64_t epoch, const TsdfConfig& config)
    : epoch_(epoch), config_(config) {}

double MapPublisher::area_m2() const {
  const double side_m = kTileSide * config_.voxel_size_m;
  return static_cast<double>(columns_.size()) * side_m * side_m;
}

std::optional<MapDelta> MapPublisher::update(TsdfMap& map) {
  std::optional<MapDelta> step = make_step(map);
  if (step) take_over(*step);
  return step;
}

std::optional<MapDelta> MapPublisher::make_step(TsdfMap& map) const {
  MapDelta delta;
  delta.epoch = epoch_;
  delta.base_version = version_;
  delta.version = version_ + 1;
  delta.digest = digest_;
  MapReader reader(map);
  const auto payload_of = [&](const TileKey& key) {
    try {
      return encode(reader, key, config_.min_publish_weight);
    } catch (const InputError&) {  // on disk, and unreadable
      map.recall({2 * key.x, 2 * key.y, 2 * key.z});
      return encode(reader, key, config_.min_publish_weight);
    }
  };
  for (const TileKey& key : tiles_of(map.take_dirty())) {
    std::vector<std::uint8_t> payload = payload_of(key);
    const auto known = tiles_.find(key);
    if (known == tiles_.end() ? payload.empty() : known->second.payload.bytes() == payload) {
      continue;
    }
    if (known != tiles_.end()) subtract(delta.digest, tile_digest(key, known->second.payload));
    if (payload.empty()) {
      delta.removed.push_back(key);
      continue;
    }
    add(delta.digest, tile_digest(key, payload));
    delta.changed.push_back({key, delta.version, std::move(payload)});
  }
  if (delta.changed.empty() && delta.removed.empty()) return std::nullopt;
  std::sort(delta.changed.begin(), delta.changed.end(),
            [](const MapTile& a, const MapTile& b) { return a.key < b.key; });
  std::sort(delta.removed.begin(), delta.removed.end());
  return delta;
}

void MapPublisher::restore(std::uint64_t version, const MapDigest& digest,
                           std::vector<MapTile> tiles) {
  POCD_CHECK(version_ == 0 && tiles_.empty() && version > 0);
  MapDelta all;
  all.epoch = epoch_;
  all.version = version;
  for (const MapTile& tile : tiles) add(all.digest, tile_digest(tile.key, tile.payload));
  if (all.digest != digest) {
    throw InputError("published tiles have digest " + all.digest.hex() + ", noted is " +
                     digest.hex());
  }
  all.changed = std::move(tiles);
  take_over(all);
}

void MapPublisher::take_over(const MapDelta& step) {
  POCD_CHECK(step.epoch == epoch_ && step.base_version == version_);
  for (const TileKey& key : step.removed) {
    const auto known = tiles_.find(key);
    POCD_CHECK(known != tiles_.end());
    bytes_ -= known->second.payload.size();
    tiles_.erase(known);
    const auto column = columns_.find({key.x, key.y});
    if (--column->second == 0) columns_.erase(column);
  }
  for (const MapTile& tile : step.changed) {
    const auto [held, is_new] = tiles_.try_emplace(tile.key);
    if (is_new) ++columns_[{tile.key.x, tile.key.y}];
    bytes_ += tile.payload.size();
    bytes_ -= held->second.payload.size();
    held->second = tile;
  }
  version_ = step.version;
  digest_ = step.digest;
}

}  // namespace pocd
