// A copy of the published map on the receiving side, without middleware. It either is the
// publisher's map at the newest version it has heard of, or says why not.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd {

enum class DeltaOutcome {
  kApplied,     ///< the copy is now at the delta's version
  kOld,         ///< nothing new: the copy has this version already
  kGap,         ///< deltas in between are missing; nothing was changed
  kWrongEpoch,  ///< of another run of the publisher; nothing was changed
  kCorrupt      ///< the digest does not fit what was received; a snapshot is needed
};

/// Not thread-safe. A new replica knows no epoch; it takes that of the first delta or snapshot.
class MapReplica {
 public:
  /// Applies a delta whose base version and epoch are those of the copy. Deltas may come twice or
  /// in any order: one that cannot be applied is not kept, and the copy is stale until the missing
  /// ones come, in order, or a snapshot.
  DeltaOutcome apply(const MapDelta& delta);

  /// What the publisher says it is at (manifest). Makes the copy stale when it is not. A new run
  /// that goes on with just this map is followed as it is.
  void note_published(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest);

  /// Takes a whole map, for example a snapshot or the transient-local tiles with a manifest.
  /// Returns whether the digest fits; if not, the copy stays as it was. An older version than the
  /// copy's, of the same epoch, is refused too unless the copy is corrupt.
  bool replace(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest,
               std::vector<MapTile> tiles);

  /// Empty when the copy equals the published map at version(), the newest one heard of; else why
  /// it does not, e.g. "at version 7, the publisher is at 9".
  std::string stale_because() const;
  bool current() const { return stale_because().empty(); }

  std::optional<std::uint64_t> epoch() const { return epoch_; }
  bool corrupt() const { return corrupt_; }  ///< holds what does not fit its digest
  std::uint64_t version() const { return version_; }
  MapDigest digest() const { return digest_; }
  const std::map<TileKey, MapTile>& tiles() const { return tiles_; }

 private:
  void hear(std::uint64_t epoch, std::uint64_t version);

  std::optional<std::uint64_t> epoch_;
  std::optional<std::uint64_t> other_epoch_;  // heard of, not ours
  std::uint64_t other_newest_ = 0;            // version heard of in that one
  std::uint64_t version_ = 0;
  std::uint64_t newest_ = 0;  // version heard of in our epoch
  bool corrupt_ = false;
  MapDigest digest_;
  std::map<TileKey, MapTile> tiles_;
};

/// Sum of tile_digest over the tiles.
MapDigest map_digest(const std::vector<MapTile>& tiles);

}  // namespace pocd
