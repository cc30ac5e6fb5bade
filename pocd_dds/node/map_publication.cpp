#include "pocd_dds/node/map_publication.hpp"

#include <algorithm>

namespace pocd::dds {
namespace {

constexpr std::uint32_t kMapId = 0;
// Small enough that losing one costs little, large enough that a frame's change is a few messages.
constexpr std::size_t kPartBytes = 256 * 1024;
constexpr std::chrono::seconds kLongestReply{5};

}  // namespace

MapPublication::MapPublication(const std::shared_ptr<Participant>& participant,
                               const NodeFile& config, std::uint64_t epoch, Wakeup& wakeup)
    : config_(config),
      publisher_(epoch, config.pipeline.map),
      tiles_(participant, topics::kMapTiles),
      deltas_(participant, topics::kMapDeltas),
      manifest_(participant, topics::kMapManifest),
      replies_(participant, topics::kSnapshotReply),
      requests_(participant, topics::kSnapshotRequest, wakeup) {}

void MapPublication::send_due(TsdfMap& map, StampNs stamp_ns, bool now) {
  const auto time = std::chrono::steady_clock::now();
  if (!now &&
      std::chrono::duration<double>(time - last_sent_).count() < config_.node.map_period_s) {
    return;
  }
  last_sent_ = time;
  const std::optional<MapDelta> delta = publisher_.update(map);
  if (!delta) return;
  stamp_ns_ = stamp_ns;
  for (auto& message : delta_messages(*delta, kMapId, stamp_ns, kPartBytes)) {
    deltas_.write(message);
  }
  for (const MapTile& tile : delta->changed) {
    auto message = tile_message(tile, kMapId, delta->epoch);
    tiles_.write(message);
    step_bytes_ += tile.payload.size();
  }
  for (const TileKey& key : delta->removed) {
    auto message = tile_message(MapTile{key, 0, {}}, kMapId, delta->epoch);
    tiles_.dispose(message);
  }
}

void MapPublication::send_manifest(std::size_t objects, bool final_version) {
  pocd_msgs::msg::MapManifest manifest;
  manifest.map_id(kMapId);
  manifest.epoch(publisher_.epoch());
  manifest.version(publisher_.version());
  manifest.stamp(to_time(stamp_ns_));
  manifest.frame_id(config_.node.map_frame);
  manifest.voxel_size(config_.pipeline.map.voxel_size_m);
  manifest.truncation(config_.pipeline.map.truncation_m());
  manifest.tile_side(kTileSide);
  manifest.tile_count(static_cast<std::uint32_t>(publisher_.tiles().size()));
  manifest.object_count(static_cast<std::uint32_t>(objects));
  manifest.digest(digest_message(publisher_.digest()));
  manifest.final_version(final_version);
  manifest_.write(manifest);
}

void MapPublication::answer_requests(bool now) {
  pocd_msgs::msg::MapSnapshotRequest request;
  SampleMeta meta;
  while (requests_.take(request, meta)) {
    if (!meta.valid || request.map_id() != kMapId) continue;
    const bool same_run = request.epoch() == publisher_.epoch();
    const std::uint64_t held = same_run ? std::min(request.version(), publisher_.version()) : 0;
    wanted_ = wanted_ ? std::min(*wanted_, held) : held;
  }
  if (!wanted_) return;
  // A reply goes to all who listen. As long as one is under way, more who ask wait for the next one
  // together; but not for ever for one who has died.
  const auto time = std::chrono::steady_clock::now();
  if (!now && !replies_.wait_acknowledged(std::chrono::milliseconds(0)) &&
      time - answered_ < kLongestReply) {
    return;
  }
  answered_ = time;
  ++snapshots_;
  for (auto& message : snapshot_messages(publisher_, *wanted_, kMapId, kPartBytes)) {
    for (const auto& tile : message.changed()) snapshot_bytes_ += tile.payload().size();
    replies_.write(message);
  }
  wanted_.reset();
}

MapTraffic MapPublication::traffic() const {
  return {publisher_.tiles().size(), publisher_.bytes(), publisher_.area_m2(), step_bytes_,
          snapshot_bytes_,           snapshots_};
}

bool MapPublication::wait_acknowledged(std::chrono::milliseconds time) {
  return deltas_.wait_acknowledged(time) && tiles_.wait_acknowledged(time) &&
         manifest_.wait_acknowledged(time) && replies_.wait_acknowledged(time);
}

std::uint64_t MapPublication::failures() const {
  return tiles_.failures() + deltas_.failures() + manifest_.failures() + replies_.failures();
}

}  // namespace pocd::dds
