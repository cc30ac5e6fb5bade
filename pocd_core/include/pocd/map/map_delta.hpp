// What leaves the process: quantised, compressed tiles and versioned deltas whose digest proves
// that a copy is the original.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pocd/map/tsdf_map.hpp"

namespace pocd {

/// A tile is 2 x 2 x 2 blocks (16^3 voxels); tile t covers [16 t, 16 t + 16) voxels per axis.
using TileKey = BlockKey;
constexpr int kTileSide = 16;

/// Sum modulo 2^128 of one XXH3-128 hash per tile of (key, payload): does not depend on order, and
/// a changed tile costs one subtraction and one addition.
struct MapDigest {
  std::uint64_t low = 0, high = 0;
  bool operator==(const MapDigest& o) const { return low == o.low && high == o.high; }
  bool operator!=(const MapDigest& o) const { return !(*this == o); }
  std::string hex() const;  ///< 32 lower-case digits
};

/// Bytes that do not change any more: copies share them, across threads, too.
class TilePayload {
 public:
  using Bytes = std::vector<std::uint8_t>;

  TilePayload() = default;
  TilePayload(Bytes bytes)  // NOLINT(google-explicit-constructor): the same thing, kept otherwise
      : bytes_(std::make_shared<const Bytes>(std::move(bytes))) {}

  const Bytes& bytes() const { return bytes_ ? *bytes_ : none(); }
  operator const Bytes&() const { return bytes(); }  // NOLINT(google-explicit-constructor)
  std::size_t size() const { return bytes().size(); }
  bool empty() const { return bytes().empty(); }

  friend bool operator==(const TilePayload& a, const TilePayload& b) {
    return a.bytes_ == b.bytes_ || a.bytes() == b.bytes();
  }
  friend bool operator!=(const TilePayload& a, const TilePayload& b) { return !(a == b); }

 private:
  static const Bytes& none() {
    static const Bytes empty;
    return empty;
  }
  std::shared_ptr<const Bytes> bytes_;
};

/// One published tile. payload: zstd frame of the quantised voxels; the layout is documented in
/// docs/tile_format.md and checked by decode_tile.
struct MapTile {
  TileKey key;
  std::uint64_t version = 0;  ///< map version at which the tile last changed
  TilePayload payload;
};

/// Decoded tile: 16^3 voxels, x fastest. distance_m within +-truncation, error at most
/// truncation / 254 plus the map's own quantisation; observed = weight reaches the publishing
/// threshold; owner 0 = background.
struct DecodedTile {
  std::array<float, kTileSide * kTileSide * kTileSide> distance_m;
  std::array<std::uint8_t, kTileSide * kTileSide * kTileSide> observed;
  std::array<std::uint32_t, kTileSide * kTileSide * kTileSide> owner;
};

/// Throws InputError with the reason for a payload that is no tile (bounded memory whatever the
/// bytes).
DecodedTile decode_tile(const std::vector<std::uint8_t>& payload, double truncation_m);

/// One step of the published map: apply to a copy at `base_version` to get `version`.
struct MapDelta {
  std::uint64_t epoch = 0;
  std::uint64_t base_version = 0;
  std::uint64_t version = 0;
  std::vector<MapTile> changed;  ///< canonical order
  std::vector<TileKey> removed;  ///< canonical order
  MapDigest digest;              ///< of the whole map at `version`
};

/// Turns the map's dirty blocks into deltas. Holds the compressed tiles (for snapshots and late
/// joiners) and the running digest. A tile whose quantised content did not change is not sent
/// again.
class MapPublisher {
 public:
  MapPublisher(std::uint64_t epoch, const TsdfConfig& config);

  /// Consumes map.take_dirty(). Nothing if no published voxel changed. Versions go 0, 1, 2, ...
  std::optional<MapDelta> update(TsdfMap& map);
  /// The two halves of update(), for those who share the publisher with other threads: the step is
  /// made while others read, and only taken over while they wait. Every step that is made has to be
  /// taken over before the next one.
  std::optional<MapDelta> make_step(TsdfMap& map) const;
  void take_over(const MapDelta& step);

  /// Goes on from what another run has published: for one that has published nothing. `tiles` are
  /// those of `version`, which is at least 1. Throws InputError when their digest is another.
  void restore(std::uint64_t version, const MapDigest& digest, std::vector<MapTile> tiles);

  std::uint64_t epoch() const { return epoch_; }
  std::uint64_t version() const { return version_; }
  MapDigest digest() const { return digest_; }
  /// Of all payloads together.
  std::size_t bytes() const { return bytes_; }
  /// Floor that tiles stand on: columns of tiles times their area [m^2].
  double area_m2() const;
  const std::map<TileKey, MapTile>& tiles() const { return tiles_; }

 private:
  std::uint64_t epoch_;
  TsdfConfig config_;
  std::uint64_t version_ = 0;
  MapDigest digest_;
  std::map<TileKey, MapTile> tiles_;
  std::size_t bytes_ = 0;
  std::map<std::pair<std::int32_t, std::int32_t>, int> columns_;  // tiles above each other
};

/// Digest contribution of one tile.
MapDigest tile_digest(const TileKey& key, const std::vector<std::uint8_t>& payload);

}  // namespace pocd
