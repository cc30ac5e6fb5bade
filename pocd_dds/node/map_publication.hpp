// The map on the bus: tiles, deltas, manifest, snapshots.
#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/node_config.hpp"
#include "pocd_dds/node/status_publication.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class MapPublication {
 public:
  /// `wakeup` is woken by requests for snapshots and must outlive it.
  MapPublication(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                 std::uint64_t epoch, Wakeup& wakeup);

  /// Sends what has changed, when the period is over or `now`.
  void send_due(TsdfMap& map, StampNs stamp_ns, bool now);
  /// What the map is; `final_version` at the end of a run.
  void send_manifest(std::size_t objects, bool final_version);
  /// One reply for all that wait, when the one before has arrived or `now`.
  void answer_requests(bool now);
  bool wait_acknowledged(std::chrono::milliseconds time);

  const MapPublisher& publisher() const { return publisher_; }
  StampNs stamp_ns() const { return stamp_ns_; }
  MapTraffic traffic() const;
  std::uint64_t failures() const;

 private:
  const NodeFile config_;
  MapPublisher publisher_;
  Writer<pocd_msgs::msg::MapTilePubSubType> tiles_;
  Writer<pocd_msgs::msg::MapDeltaPubSubType> deltas_;
  Writer<pocd_msgs::msg::MapManifestPubSubType> manifest_;
  Writer<pocd_msgs::msg::MapSnapshotReplyPubSubType> replies_;
  Reader<pocd_msgs::msg::MapSnapshotRequestPubSubType> requests_;
  StampNs stamp_ns_ = 0;
  std::uint64_t step_bytes_ = 0, snapshot_bytes_ = 0, snapshots_ = 0;
  std::optional<std::uint64_t> wanted_;  // version that subscribers who wait have at least
  std::chrono::steady_clock::time_point answered_{};
  std::chrono::steady_clock::time_point last_sent_{};
};

}  // namespace pocd::dds
