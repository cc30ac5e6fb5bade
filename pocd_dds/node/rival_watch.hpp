// Whether another node publishes the same map.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Two nodes with one map id write the same keys: subscribers can follow one of them only. Not
/// thread-safe.
class RivalWatch {
 public:
  RivalWatch(const std::shared_ptr<Participant>& participant, const MapRun& own, Wakeup& wakeup)
      : own_(own), manifests_(participant, topics::kMapManifest, wakeup) {}

  /// Epochs that were not heard before.
  std::vector<std::uint64_t> take() {
    std::vector<std::uint64_t> fresh;
    constexpr int kMost = 100;  // of one turn
    manifests_.take_some(kMost, [&](const auto& manifest, const SampleMeta& meta) {
      const bool same_map = meta.valid && manifest.map_id() == own_.map_id;
      // One that has ended its run says so for as long as it is there, and is none.
      if (!same_map || manifest.epoch() == own_.epoch || manifest.final_version()) return;
      ++manifests_heard_;
      if (known_.size() < kMostKnown && known_.insert(manifest.epoch()).second) {
        fresh.push_back(manifest.epoch());
      }
    });
    return fresh;
  }
  std::uint64_t manifests_heard() const { return manifests_heard_; }
  /// What of the manifests could not be heard or read.
  void count_problems(ProblemCounter& problems) {
    problems.count_incompatible(manifests_);
    problems.count_damaged(manifests_);
  }

 private:
  static constexpr std::size_t kMostKnown = 100;
  const MapRun own_;
  Reader<pocd_msgs::msg::MapManifestPubSubType> manifests_;
  std::set<std::uint64_t> known_;
  std::uint64_t manifests_heard_ = 0;
};

}  // namespace pocd::dds
