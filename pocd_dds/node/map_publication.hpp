// The map on the bus: tiles, deltas, manifest, snapshots.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <set>

#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/byte_budget.hpp"
#include "pocd_dds/node/node_config.hpp"
#include "pocd_dds/node/status_publication.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// What is to be sent waits here and leaves at `node.map_rate_mb_s`: deltas first, then tiles, then
/// parts of snapshots. Paced here and not by a flow controller of Fast DDS, see
/// docs/decisions/0004-pacing-of-map-data.md. Not thread-safe.
class MapPublication {
 public:
  /// `wakeup` is woken by requests for snapshots and must outlive it.
  MapPublication(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                 std::uint64_t epoch, Wakeup& wakeup);

  /// Makes a step of what has changed, when the period is over and the step before has left, or
  /// `now`. True when it did: all that the map held is in the steps.
  bool send_due(TsdfMap& map, StampNs stamp_ns, bool now);
  /// What the map is, as far as its deltas have left; `final_version` at the end of a run.
  void send_manifest(std::size_t objects, bool final_version);
  /// One reply for all that wait, when the one before has arrived.
  void answer_requests();
  /// As much as the rate allows. To be called often, as long as something is waiting().
  void send_waiting();
  /// Messages that are to be sent.
  std::size_t waiting() const {
    return deltas_waiting_.size() + tiles_waiting_.size() + replies_waiting_.size();
  }
  /// The deltas of all steps have been written.
  bool deltas_written() const { return deltas_waiting_.empty(); }
  bool wait_acknowledged(std::chrono::milliseconds time);

  const MapPublisher& publisher() const { return publisher_; }
  /// Tiles that steps have changed or removed; for the reader to empty.
  std::set<TileKey>& changed() { return changed_; }
  StampNs stamp_ns() const { return stamp_ns_; }
  MapTraffic traffic() const;
  std::uint64_t failures() const;

 private:
  bool send_delta();
  bool send_tile();
  bool send_reply();

  struct Announced {
    std::uint64_t version = 0;
    MapDigest digest;
    std::size_t tiles = 0;
  };

  const NodeFile config_;
  const std::uint32_t map_id_;
  MapPublisher publisher_;
  Writer<pocd_msgs::msg::MapTilePubSubType> tiles_;
  Writer<pocd_msgs::msg::MapDeltaPubSubType> deltas_;
  Writer<pocd_msgs::msg::MapManifestPubSubType> manifest_;
  Writer<pocd_msgs::msg::MapSnapshotReplyPubSubType> replies_;
  Reader<pocd_msgs::msg::MapSnapshotRequestPubSubType> requests_;
  StampNs stamp_ns_ = 0;
  Announced announced_;
  ByteBudget budget_;
  std::deque<pocd_msgs::msg::MapDelta> deltas_waiting_;
  std::deque<TileKey> tiles_waiting_;  // what they are is looked up when they leave
  std::set<TileKey> on_bus_, changed_;
  std::deque<pocd_msgs::msg::MapSnapshotReply> replies_waiting_;
  std::uint64_t step_bytes_ = 0, snapshot_bytes_ = 0, snapshots_ = 0;
  std::optional<std::uint64_t> wanted_;  // version that subscribers who wait have at least
  std::chrono::steady_clock::time_point asked_{}, answered_{};
  std::chrono::steady_clock::time_point last_sent_{};
};

}  // namespace pocd::dds
