// The surfaces that were replaced, for the map of another time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "pocd/common/types.hpp"
#include "view/piece.hpp"

namespace pocd::view {

/// Each version of a tile's or chunk's surface with the stamp from which on it holds. Versions that
/// follow one another within a thousandth of the known time are one. Beyond `most_bytes` the oldest
/// are forgotten, and the map is known from later on. Not thread-safe.
class PastSurfaces {
 public:
  static constexpr std::size_t kMostBytes = 256u << 20;

  struct Version {
    StampNs stamp_ns = 0;
    std::uint64_t revision = 0;  ///< never 0
    Piece piece;
  };
  using Versions = std::vector<Version>;  ///< by stamp

  explicit PastSurfaces(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  /// The whole map is known from here on; the first call counts.
  void known_from(StampNs stamp_ns);
  void put_tile(const TileKey& key, std::uint64_t revision, Piece piece, StampNs stamp_ns);
  void put_chunk(const ChunkKey& key, std::uint64_t revision, Piece piece, StampNs stamp_ns);

  /// The map of any later time is known; nothing: of no time yet.
  std::optional<StampNs> known_since() const { return known_since_; }
  const std::map<ChunkKey, Versions>& chunks() const { return chunks_; }
  /// Tiles of the chunk, or null.
  const std::map<TileKey, Versions>* tiles(const ChunkKey& chunk) const;
  /// What is shown at a stamp, or now (nothing); null: nothing is there.
  static const Version* at(const Versions& versions, std::optional<StampNs> stamp_ns);
  /// Of what was replaced.
  std::size_t bytes() const { return bytes_; }

 private:
  struct Replaced {
    bool chunk = false;
    TileKey key;
    std::uint64_t revision = 0;
  };
  void put(Versions& versions, Version version, Replaced name);
  void forget_oldest();

  std::size_t most_bytes_, bytes_ = 0;
  std::optional<StampNs> known_since_;
  StampNs newest_ns_ = 0;
  std::map<ChunkKey, Versions> chunks_;
  std::map<ChunkKey, std::map<TileKey, Versions>> tiles_;
  std::deque<Replaced> replaced_;  // the one that was replaced first is first
};

}  // namespace pocd::view
