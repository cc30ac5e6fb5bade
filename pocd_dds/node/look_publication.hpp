// When each region of the map was last looked at, on the bus.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd_dds/bridge/look_messages.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/byte_budget.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// One message per sector that has changed, each at most every kPeriod, all of them together at
/// most kBytesPerS to each subscriber. For two threads: that of the pipeline, and one that sends.
class LookPublication {
 public:
  static constexpr std::chrono::seconds kPeriod{5};
  static constexpr double kBytesPerS = 500e3;

  LookPublication(const std::shared_ptr<Participant>& participant, const MapRun& run)
      : run_(run), writer_(participant, topics::kMapLooks), budget_(kBytesPerS) {}

  /// Looks of before this run. Before all others.
  void restored(const std::vector<RegionLook>& looks) { note(looks, false); }
  /// The thread of the pipeline: looks of this run.
  void looked_at(const std::vector<RegionLook>& looks) { note(looks, true); }

  /// The thread that sends: what is due and within the rate. To be called often.
  void send_due();
  /// The last looks of the run.
  bool finish(std::chrono::steady_clock::time_point end);

  /// Any thread.
  std::uint64_t failures() const { return writer_.failures(); }

 private:
  void note(const std::vector<RegionLook>& looks, bool in_run);
  bool send(const SectorKey& key);

  const MapRun run_;
  std::mutex mutex_;  // guards what follows
  std::map<SectorKey, std::map<BlockKey, SectorLook>> sectors_;
  std::set<SectorKey> changed_;

  // Only the thread that sends.
  Writer<pocd_msgs::msg::MapLooksPubSubType> writer_;
  std::set<SectorKey> due_;
  ByteBudget budget_;
  std::chrono::steady_clock::time_point began_{};
};

}  // namespace pocd::dds
