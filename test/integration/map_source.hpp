// A map that changes at random and is published by the node's own code, in the test's process.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "bus_harness.hpp"
#include "over_the_bus.hpp"
#include "pocd/common/random.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/map_publication.hpp"

namespace pocd {

/// Blocks of noise, which hardly compress: a tile has some 4 KB per block.
inline void fill_block(TsdfMap& map, const BlockKey& key, Random& random) {
  VoxelBlock& block = map.touch(key);
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    block.tsdf[i] = static_cast<std::int16_t>(static_cast<int>(random.below(60000)) - 30000);
    block.weight[i] = 10;
    block.owner[i] = 1 + static_cast<std::uint32_t>(random.below(3));
  }
}

/// Not thread-safe, except history_at().
class MapSource {
 public:
  MapSource(const TestDomain& domain, std::uint64_t epoch, double rate_mb_s,
            const std::string& profiles_file = "", int map_id = 0)
      : map(TsdfConfig{}),
        random(epoch),
        participant(make(domain, profiles_file)),
        publication(participant, config(rate_mb_s, map_id), epoch, wakeup) {}

  /// Changes some blocks of a map of at most `size`^2 columns of tiles, removes some, publishes, at
  /// the latest when the step before has left or `now`.
  void step(int size, bool now) {
    const auto cell = [&] { return static_cast<std::int32_t>(random.below(2 * size)); };
    for (int i = 0; i < 4; ++i) fill_block(map, {cell(), cell(), 0}, random);
    if (random.uniform() < 0.3) map.clear_object(ObjectId{1});
    if (random.uniform() < 0.1) {
      // A block without owners is empty to the publisher.
      const BlockKey key{cell(), cell(), 0};
      if (map.find(key)) map.touch(key).weight.fill(0);
    }
    publish(now);
  }
  void publish(bool now = true) {
    const std::lock_guard<std::mutex> lock(mutex_);  // before anybody can have the new version
    if (publication.begin_step(now)) publication.send_step(publication.make_step(map), 1);
    publication.send_waiting();
    history_[publication.publisher().version()] = publication.publisher().digest();
  }
  void turn() {
    publication.answer_requests();
    publication.send_waiting();
  }
  MapDigest history_at(std::uint64_t version) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return history_.at(version);
  }

  TsdfMap map;
  Random random;
  dds::Wakeup wakeup;
  std::shared_ptr<dds::Participant> participant;
  dds::MapPublication publication;

 private:
  static std::shared_ptr<dds::Participant> make(const TestDomain& domain,
                                                const std::string& profiles_file) {
    talk_over_the_bus();
    return std::make_shared<dds::Participant>(
        dds::BusOptions{domain.number(), profiles_file, "pocd_test"});
  }
  static NodeFile config(double rate_mb_s, int map_id) {
    NodeFile file;
    file.node.map_id = map_id;
    file.node.map_period_s = 0.0;
    file.node.map_rate_mb_s = rate_mb_s;
    return file;
  }
  mutable std::mutex mutex_;
  std::map<std::uint64_t, MapDigest> history_{{0, MapDigest{}}};
};

}  // namespace pocd
