// Follows a published map from whatever arrives of it: manifests, deltas, single tiles, snapshots,
// in any order, with losses and repetitions. Without middleware.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd/map/map_replica.hpp"

namespace pocd {

/// Every tile newer than `base_version` of the same run (0: every tile), and the keys of all.
struct MapSnapshot {
  std::uint64_t epoch = 0;
  std::uint64_t base_version = 0;
  std::uint64_t version = 0;
  MapDigest digest;  ///< of the whole map at `version`
  std::vector<TileKey> present;
  std::vector<MapTile> changed;
};

struct FollowerCounts {
  std::uint64_t deltas = 0;     ///< received
  std::uint64_t gaps = 0;       ///< times that the copy lacked a delta
  std::uint64_t corrupt = 0;    ///< deltas and snapshots that did not fit their digest
  std::uint64_t snapshots = 0;  ///< taken
  std::uint64_t gathered = 0;   ///< times that the copy was made of single tiles
};

/// Not thread-safe. The copy either has the digest of the newest version heard of, or is stale.
class MapFollower {
 public:
  MapFollower();
  ~MapFollower();

  /// What the publisher says it is at (manifest).
  void published(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest);
  void delta(MapDelta delta);
  /// Another run publishes under the epoch that is followed: what is held and known is of no use.
  void forget();
  /// Whether a snapshot, of which tiles and keys do not matter here, would lead on.
  bool needs(const MapSnapshot& snapshot) const;
  /// False when it does not lead on, or does not fit its digest.
  bool snapshot(MapSnapshot snapshot);

  /// Single tiles count between these two. All tiles that exist have to come after the start, and
  /// every change of one from then on.
  void start_gathering();
  void stop_gathering();
  bool gathering() const { return gathering_; }
  void tile(std::uint64_t epoch, MapTile tile);
  void tile_gone(std::uint64_t epoch, const TileKey& key);

  /// Empty when the copy is the publisher's map; else why not.
  std::string stale_because() const;
  bool current() const { return stale_because().empty(); }
  /// True when the copy is of the publisher's present run, so that a part of the map is enough.
  bool has_base() const;
  /// The delta that follows the copy's version is the one with this base.
  bool follows(std::uint64_t epoch, std::uint64_t base_version) const;

  const MapReplica& replica() const { return replica_; }
  const FollowerCounts& counts() const { return counts_; }

 private:
  struct Gatherings;
  void know(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest);
  void apply_recent();
  void try_gathered(std::uint64_t epoch);

  MapReplica replica_;
  FollowerCounts counts_;
  std::optional<std::uint64_t> published_epoch_;
  bool gap_ = false;
  bool gathering_ = false;
  std::deque<MapDelta> recent_;
  std::unique_ptr<Gatherings> gathered_;
};

}  // namespace pocd
