#include "pocd/map/map_follower.hpp"

#include <algorithm>
#include <utility>

#include "tile_gathering.hpp"

namespace pocd {
namespace {

// Deltas that came before what they build on; what is asked for meanwhile needs the later ones.
constexpr std::size_t kRecentDeltas = 200;
// Versions whose digest is remembered: tiles may lag that far behind the deltas.
constexpr std::size_t kKnownVersions = 200;
// Runs of publishers that are gathered at a time: a new one may send tiles before it says what it
// is.
constexpr std::size_t kRuns = 4;

}  // namespace

struct MapFollower::Gatherings {
  struct Run {
    TileGathering tiles;
    std::deque<std::pair<std::uint64_t, MapDigest>> known;  // version and its digest
  };

  Run& run(std::uint64_t epoch, const std::optional<std::uint64_t>& keep) {
    if (runs.count(epoch) == 0 && runs.size() >= kRuns) {
      const auto victim = std::find_if(runs.begin(), runs.end(),
                                       [&](const auto& entry) { return keep != entry.first; });
      runs.erase(victim);
    }
    return runs[epoch];
  }
  std::map<std::uint64_t, Run> runs;
};

MapFollower::MapFollower() : gathered_(std::make_unique<Gatherings>()) {}
MapFollower::~MapFollower() = default;

void MapFollower::know(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest) {
  auto& known = gathered_->run(epoch, published_epoch_).known;
  known.emplace_back(version, digest);
  if (known.size() > kKnownVersions) known.pop_front();
}

void MapFollower::published(std::uint64_t epoch, std::uint64_t version, const MapDigest& digest) {
  const auto foreign = [epoch](const MapDelta& delta) { return delta.epoch != epoch; };
  recent_.erase(std::remove_if(recent_.begin(), recent_.end(), foreign), recent_.end());
  published_epoch_ = epoch;
  replica_.note_published(epoch, version, digest);
  know(epoch, version, digest);
  // An empty map needs nothing to arrive.
  if (digest == MapDigest{} && (replica_.epoch() != epoch || replica_.version() < version)) {
    replica_.replace(epoch, version, digest, {});
  }
  try_gathered(epoch);
  apply_recent();
}

void MapFollower::forget() {
  const bool gathering = gathering_;
  replica_ = MapReplica();
  recent_.clear();
  gathered_ = std::make_unique<Gatherings>();
  published_epoch_.reset();
  gap_ = false;
  gathering_ = gathering;
}

void MapFollower::delta(MapDelta delta) {
  ++counts_.deltas;
  const std::uint64_t epoch = delta.epoch;
  know(epoch, delta.version, delta.digest);
  recent_.push_back(std::move(delta));
  apply_recent();
  if (recent_.size() > kRecentDeltas) recent_.pop_front();
  try_gathered(epoch);
}

void MapFollower::apply_recent() {
  bool progress = true, gap = false;
  while (progress) {
    progress = gap = false;
    for (auto delta = recent_.begin(); delta != recent_.end();) {
      const DeltaOutcome outcome = replica_.apply(*delta);
      gap = gap || outcome == DeltaOutcome::kGap;
      if (outcome == DeltaOutcome::kGap || outcome == DeltaOutcome::kWrongEpoch) {
        ++delta;
        continue;
      }
      counts_.corrupt += outcome == DeltaOutcome::kCorrupt;
      progress = progress || outcome == DeltaOutcome::kApplied;
      delta = recent_.erase(delta);
    }
  }
  counts_.gaps += gap && !gap_;
  gap_ = gap;
}

bool MapFollower::needs(const MapSnapshot& snapshot) const {
  if (published_epoch_ && *published_epoch_ != snapshot.epoch) return false;
  const bool usable = replica_.epoch() == snapshot.epoch && !replica_.corrupt();
  if (snapshot.base_version > 0 && !usable) return false;
  return !usable ||
         (snapshot.base_version <= replica_.version() && replica_.version() < snapshot.version);
}

bool MapFollower::snapshot(MapSnapshot snapshot) {
  if (!needs(snapshot)) return false;
  const bool same_run = replica_.epoch() == snapshot.epoch;
  know(snapshot.epoch, snapshot.version, snapshot.digest);
  std::map<TileKey, MapTile> tiles;
  for (MapTile& tile : snapshot.changed) {
    const TileKey key = tile.key;
    tiles[key] = std::move(tile);
  }
  // Tiles that are not repeated are those of the copy.
  std::vector<MapTile> all;
  for (const TileKey& key : snapshot.present) {
    const auto sent = tiles.find(key);
    if (sent != tiles.end()) {
      all.push_back(std::move(sent->second));
      continue;
    }
    const auto held = replica_.tiles().find(key);
    if (same_run && held != replica_.tiles().end()) all.push_back(held->second);
  }
  if (!replica_.replace(snapshot.epoch, snapshot.version, snapshot.digest, std::move(all))) {
    ++counts_.corrupt;
    return false;
  }
  ++counts_.snapshots;
  apply_recent();
  return true;
}

void MapFollower::start_gathering() {
  for (auto& entry : gathered_->runs) entry.second.tiles = TileGathering();
  gathering_ = true;
}

void MapFollower::stop_gathering() {
  for (auto& entry : gathered_->runs) entry.second.tiles = TileGathering();
  gathering_ = false;
}

void MapFollower::tile(std::uint64_t epoch, MapTile tile) {
  if (!gathering_) return;
  gathered_->run(epoch, published_epoch_).tiles.put(std::move(tile));
  try_gathered(epoch);
}

void MapFollower::tile_gone(std::uint64_t epoch, const TileKey& key) {
  if (!gathering_) return;
  gathered_->run(epoch, published_epoch_).tiles.remove(key);
  try_gathered(epoch);
}

void MapFollower::try_gathered(std::uint64_t epoch) {
  if (!gathering_ || published_epoch_ != epoch || current()) return;
  const auto& run = gathered_->run(epoch, published_epoch_);
  if (run.tiles.size() == 0) return;
  std::optional<std::uint64_t> version;
  for (const auto& [known, digest] : run.known) {
    if (run.tiles.has_sum(digest) && (!version || known > *version)) version = known;
  }
  const bool same_run = replica_.epoch() == epoch;
  if (!version || (same_run && !replica_.corrupt() && *version <= replica_.version())) return;
  if (!replica_.replace(epoch, *version, run.tiles.digest(), run.tiles.list())) return;
  ++counts_.gathered;
  apply_recent();
}

std::string MapFollower::stale_because() const {
  if (!published_epoch_) return "no publisher heard of yet";
  return replica_.stale_because();
}

bool MapFollower::has_base() const {
  return published_epoch_ && replica_.epoch() == published_epoch_ && !replica_.corrupt() &&
         replica_.version() > 0;
}

bool MapFollower::follows(std::uint64_t epoch, std::uint64_t base_version) const {
  return replica_.epoch() == epoch && replica_.version() == base_version;
}

}  // namespace pocd
