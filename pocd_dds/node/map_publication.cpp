#include "pocd_dds/node/map_publication.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace pocd::dds {
namespace {

// Small enough that what else is sent does not wait long, large enough that a frame's change is a
// few messages.
constexpr std::size_t kPartBytes = 64 * 1024;
constexpr std::chrono::seconds kLongestReply{5};
constexpr int kMostRequests = 100;  // taken in one turn
constexpr std::chrono::milliseconds kTurn{5};
/// A turn of sending ends after this time: the thread has a state to tell and questions to answer.
constexpr std::chrono::milliseconds kLongestTurn{50};

template <class Message>
std::size_t payload_bytes(const Message& message) {
  std::size_t bytes = 0;
  for (const auto& tile : message.changed()) bytes += tile.payload().size();
  return bytes;
}

/// What one message takes of the network: each subscriber gets its own.
std::size_t network_bytes(std::size_t payload, const RawWriter& writer) {
  constexpr std::size_t kHeaders = 200;
  return (payload + kHeaders) * static_cast<std::size_t>(std::max(writer.matched(), 0));
}

}  // namespace

MapPublication::MapPublication(const std::shared_ptr<Participant>& participant,
                               const NodeFile& config, std::uint64_t epoch, Wakeup& wakeup,
                               std::uint64_t lineage)
    : config_(config),
      map_id_(static_cast<std::uint32_t>(config.node.map_id)),
      lineage_(lineage != 0 ? lineage : epoch),
      wakeup_(wakeup),
      tiles_(participant, topics::kMapTiles),
      deltas_(participant, topics::kMapDeltas),
      manifest_(participant, topics::kMapManifest),
      replies_(participant, topics::kSnapshotReply),
      requests_(participant, topics::kSnapshotRequest, wakeup),
      publisher_(epoch, config.pipeline.map),
      budget_(1e6 * config.node.map_rate_mb_s) {}

void MapPublication::restored(StampNs stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [key, tile] : publisher_.tiles()) {
    kept_waiting_.push_back(key);
    changed_.insert(key);
    not_looked_.insert(region_of(key));
  }
  stamp_ns_ = stamp_ns;
  announced_ = {publisher_.version(), publisher_.digest(), publisher_.tiles().size(), stamp_ns};
}

void MapPublication::looked_at(const std::vector<RegionLook>& looks) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (not_looked_.empty()) return;
  for (const auto& [region, stamp_ns] : looks) {
    if (not_looked_.erase(region) == 0) continue;
    constexpr std::int32_t kTiles = (1 << BlockKey::kRegionShift) / 2;  // along a side
    for (std::int32_t i = 0; i < kTiles * kTiles * kTiles; ++i) {
      const TileKey key{region.x * kTiles + i % kTiles, region.y * kTiles + i / kTiles % kTiles,
                        region.z * kTiles + i / kTiles / kTiles};
      if (publisher_.tiles().count(key) > 0) changed_.insert(key);
    }
  }
}

bool MapPublication::begin_step(bool now) {
  const auto time = std::chrono::steady_clock::now();
  if (!now) {
    if (std::chrono::duration<double>(time - last_step_).count() < config_.node.map_period_s) {
      return false;
    }
    // When the network does not keep up, steps become fewer and larger instead of a queue that
    // grows.
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!deltas_waiting_.empty() || !tiles_waiting_.empty()) return false;
  }
  last_step_ = time;
  return true;
}

void MapPublication::send_step(std::optional<MapDelta> step, StampNs stamp_ns) {
  if (!step) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    publisher_.take_over(*step);
    stamp_ns_ = stamp_ns;
    for (const MapTile& tile : step->changed) tiles_waiting_.push_back(tile.key);
    for (const MapTile& tile : step->changed) changed_.insert(tile.key);
    changed_.insert(step->removed.begin(), step->removed.end());
    tiles_waiting_.insert(tiles_waiting_.end(), step->removed.begin(), step->removed.end());
    deltas_waiting_.push_back(delta_parts(std::move(*step), map_id_, stamp_ns, kPartBytes));
  }
  wakeup_.wake();
}

void MapPublication::send_waiting() {
  const auto time = std::chrono::steady_clock::now();
  // What changed now, then what somebody waits for, then what is kept for late joiners.
  while (budget_.open(time) &&
         (send_delta() || send_tile(tiles_waiting_) || send_reply() || send_tile(kept_waiting_)) &&
         std::chrono::steady_clock::now() - time < kLongestTurn) {
  }
}

bool MapPublication::send_delta() {
  DeltaParts* step = nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (deltas_waiting_.empty()) return false;
    step = &deltas_waiting_.front();  // this thread's: the other one only appends
  }
  auto message = step->next();
  budget_.spend(network_bytes(payload_bytes(message), deltas_));
  deltas_.write(message);  // one that is refused is a gap, which mirrors repair
  if (step->left() > 0) return true;
  const std::lock_guard<std::mutex> lock(mutex_);
  deltas_waiting_.pop_front();
  if (deltas_waiting_.empty()) {
    announced_ = {publisher_.version(), publisher_.digest(), publisher_.tiles().size(), stamp_ns_};
  }
  return true;
}

bool MapPublication::send_tile(std::deque<TileKey>& queue) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (queue.empty()) return false;
  const TileKey key = queue.front();
  const auto known = publisher_.tiles().find(key);
  const bool present = known != publisher_.tiles().end();
  const MapTile tile = present ? known->second : MapTile{key, 0, {}};
  lock.unlock();
  auto message = tile_message(tile, map_id_, publisher_.epoch());
  // One that is refused is tried again next time: nobody would miss it otherwise.
  if (present) {
    if (!tiles_.write(message)) return false;
    on_bus_.insert(key);
  } else if (on_bus_.count(key) > 0) {
    if (!tiles_.dispose(message)) return false;
    on_bus_.erase(key);
  }
  step_bytes_ += tile.payload.size();
  budget_.spend(network_bytes(tile.payload.size(), tiles_));
  lock.lock();
  queue.pop_front();  // only this thread takes from it
  return true;
}

bool MapPublication::send_reply() {
  if (!reply_waiting_) return false;
  auto message = reply_waiting_->next();
  const std::size_t bytes = payload_bytes(message);
  snapshot_bytes_ += bytes;
  budget_.spend(network_bytes(bytes, replies_));
  replies_.write(message);
  if (reply_waiting_->left() == 0) reply_waiting_.reset();
  answered_ = std::chrono::steady_clock::now();
  return true;
}

void MapPublication::send_manifest(std::size_t objects, bool final_version,
                                   const MemoryStatus& kept) {
  pocd_msgs::msg::MapManifest manifest;
  manifest.map_id(map_id_);
  manifest.epoch(publisher_.epoch());
  manifest.lineage(lineage_);
  manifest.version(announced_.version);
  manifest.stamp(to_time(announced_.stamp_ns));
  manifest.frame_id(config_.node.map_frame);
  manifest.voxel_size(config_.pipeline.map.voxel_size_m);
  manifest.truncation(config_.pipeline.map.truncation_m());
  manifest.tile_side(kTileSide);
  manifest.tile_count(static_cast<std::uint32_t>(announced_.tiles));
  manifest.object_count(static_cast<std::uint32_t>(objects));
  manifest.digest(digest_message(announced_.digest));
  manifest.final_version(final_version);
  manifest.stored_version(kept.stored_version);
  manifest.stored_seq(kept.stored_event);
  manifest_.write(manifest);
}

void MapPublication::answer_requests() {
  requests_.take_some(kMostRequests, [&](const auto& request, const SampleMeta& meta) {
    if (!meta.valid || request.map_id() != map_id_) return;
    const bool same_run = request.epoch() == publisher_.epoch();
    const std::uint64_t held = same_run ? request.version() : 0;
    wanted_ = wanted_ ? std::min(*wanted_, held) : held;
    asked_ = std::chrono::steady_clock::now();
  });
  if (!wanted_ || reply_waiting_) return;
  // Who asks has a reader of replies; this side may hear of it later, or it has gone again.
  if (replies_.matched() == 0) {
    if (std::chrono::steady_clock::now() - asked_ >= kLongestReply) wanted_.reset();
    return;
  }
  // A reply goes to all who listen. As long as one is under way, more who ask wait for the next one
  // together; but not for ever for one who has died.
  if (!replies_.wait_acknowledged(std::chrono::milliseconds(0)) &&
      std::chrono::steady_clock::now() - answered_ < kLongestReply) {
    return;
  }
  ++snapshots_;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::uint64_t held = std::min(*wanted_, publisher_.version());
    reply_waiting_ = snapshot_parts(publisher_, held, map_id_, kPartBytes);
  }
  wanted_.reset();
}

void MapPublication::count_problems(ProblemCounter& problems) {
  problems.count_incompatible(requests_);
  problems.count_damaged(requests_);
}

std::size_t MapPublication::waiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t messages =
      tiles_waiting_.size() + kept_waiting_.size() + (reply_waiting_ ? reply_waiting_->left() : 0);
  for (const DeltaParts& step : deltas_waiting_) messages += step.left();
  return messages;
}

bool MapPublication::deltas_written() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return deltas_waiting_.empty();
}

MapTraffic MapPublication::traffic() const {
  const std::size_t messages = waiting();
  const std::lock_guard<std::mutex> lock(mutex_);
  return {publisher_.version(), publisher_.tiles().size(), publisher_.bytes(), publisher_.area_m2(),
          step_bytes_,          snapshot_bytes_,           snapshots_,         messages};
}

bool MapPublication::wait_acknowledged(std::chrono::steady_clock::time_point end) {
  for (;; std::this_thread::sleep_for(kTurn)) {
    answer_requests();
    send_waiting();
    if (waiting() == 0 && (!wanted_ || replies_.matched() == 0)) break;
    if (std::chrono::steady_clock::now() >= end) return false;
  }
  return deltas_.wait_acknowledged(end) && tiles_.wait_acknowledged(end) &&
         manifest_.wait_acknowledged(end) && replies_.wait_acknowledged(end);
}

std::uint64_t MapPublication::failures() const {
  return tiles_.failures() + deltas_.failures() + manifest_.failures() + replies_.failures();
}

}  // namespace pocd::dds
