// The map on the bus: tiles, deltas, manifest, snapshots.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "pocd/config/node_config.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/bridge/map_messages.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/byte_budget.hpp"
#include "pocd_dds/node/status_publication.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// What is to be sent waits here and leaves at `node.map_rate_mb_s`: deltas first, then tiles, then
/// parts of snapshots. Paced here and not by a flow controller of Fast DDS, see
/// docs/decisions/0004-pacing-of-map-data.md.
///
/// For two threads: one changes the map and makes steps of it, one sends. Neither compresses nor
/// writes to the bus while the other has to wait for it.
class MapPublication {
 public:
  /// `wakeup` is woken by requests for snapshots and by new steps, and must outlive it. `lineage`
  /// is that of the memory; 0: the epoch, without one.
  MapPublication(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                 std::uint64_t epoch, Wakeup& wakeup, std::uint64_t lineage = 0);

  /// Goes on from what another run has published: publisher() has been restored. Before all others.
  void restored(StampNs stamp_ns);
  /// The thread that changes the map: regions that were looked at in this run.
  void looked_at(const std::vector<RegionLook>& looks);
  /// Regions from before this run that were not looked at since; while hold() is held.
  const std::set<BlockKey>& not_looked() const { return not_looked_; }
  /// To be restored.
  MapPublisher& publisher_to_restore() { return publisher_; }

  // The thread that changes the map:

  /// A step is to be made, because the period is over and the step before has left, or `now`.
  bool begin_step(bool now);
  /// What has changed since the last step, if anything.
  std::optional<MapDelta> make_step(TsdfMap& map) const { return publisher_.make_step(map); }
  /// Takes over what make_step() made.
  void send_step(std::optional<MapDelta> step, StampNs stamp_ns);

  // The thread that sends:

  /// As much as the rate allows. To be called often, as long as something is waiting().
  void send_waiting();
  /// One reply for all that wait, when the one before has arrived.
  void answer_requests();
  /// What the map is, as far as its deltas have left; `final_version` at the end of a run.
  void send_manifest(std::size_t objects, bool final_version, const MemoryStatus& kept = {});
  /// What of the requests could not be heard or read.
  void count_problems(ProblemCounter& problems);
  /// Messages that are to be sent.
  std::size_t waiting() const;
  MapTraffic traffic() const;
  bool wait_acknowledged(std::chrono::steady_clock::time_point end);

  // Any thread:

  /// The deltas of all steps have been written.
  bool deltas_written() const;
  std::uint64_t failures() const;
  /// As long as it is held, publisher() and changed() stay as they are.
  [[nodiscard]] std::unique_lock<std::mutex> hold() const {
    return std::unique_lock<std::mutex>(mutex_);
  }
  const MapPublisher& publisher() const { return publisher_; }
  /// Tiles that steps have changed or removed; for the reader to empty.
  std::set<TileKey>& changed() { return changed_; }

 private:
  bool send_delta();
  bool send_tile(std::deque<TileKey>& queue);
  bool send_reply();

  struct Announced {
    std::uint64_t version = 0;
    MapDigest digest;
    std::size_t tiles = 0;
    StampNs stamp_ns = 0;
  };

  const NodeFile config_;
  const std::uint32_t map_id_;
  const std::uint64_t lineage_;
  Wakeup& wakeup_;
  Writer<pocd_msgs::msg::MapTilePubSubType> tiles_;
  Writer<pocd_msgs::msg::MapDeltaPubSubType> deltas_;
  Writer<pocd_msgs::msg::MapManifestPubSubType> manifest_;
  Writer<pocd_msgs::msg::MapSnapshotReplyPubSubType> replies_;
  Reader<pocd_msgs::msg::MapSnapshotRequestPubSubType> requests_;

  // Only the thread that makes steps.
  std::chrono::steady_clock::time_point last_step_{};

  mutable std::mutex mutex_;  // what both threads use
  MapPublisher publisher_;    // the thread that makes steps may read it without
  StampNs stamp_ns_ = 0;
  std::deque<DeltaParts> deltas_waiting_;
  std::deque<TileKey> tiles_waiting_;  // what they are is looked up when they leave
  std::deque<TileKey> kept_waiting_;   // tiles from before this run: after all others
  std::set<TileKey> changed_;
  std::set<BlockKey> not_looked_;

  // Only the thread that sends.
  Announced announced_;
  ByteBudget budget_;
  std::set<TileKey> on_bus_;
  std::optional<SnapshotParts> reply_waiting_;
  std::uint64_t step_bytes_ = 0, snapshot_bytes_ = 0, snapshots_ = 0;
  std::optional<std::uint64_t> wanted_;  // version that subscribers who wait have at least
  std::chrono::steady_clock::time_point asked_{}, answered_{};
};

}  // namespace pocd::dds
