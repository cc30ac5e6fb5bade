// What late joiners of the bus get, for the files of a split recording after the first.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "pocd_dds/recording/record_queue.hpp"

namespace pocd::dds {

/// The last samples of latched topics: of a keyed one the newest of each instance, of another one
/// what the writers that are there would keep for a late joiner, as far as that can be told from
/// outside. Not thread-safe.
class LatchedSamples {
 public:
  void note(const QueuedSample& sample) {
    if (!sample.latch) return;
    const Latch& latch = *sample.latch;
    std::map<LatchKey, Kept>& sources = channels_[latch.channel];
    if (latch.part == Latch::Part::kGone || latch.part == Latch::Part::kWriterGone) {
      sources.erase(latch.source);
      return;
    }
    Kept& kept = sources[latch.source];
    if (latch.part == Latch::Part::kInstance) {
      kept.instance = copy(sample);
      return;
    }
    kept.bytes += sample.payload.size();
    kept.samples.push_back(copy(sample));
    while (kept.samples.size() > 1 &&
           (latch.keyed || kept.samples.size() > kMostSamples || kept.bytes > kMostBytes)) {
      kept.bytes -= kept.samples.front().payload.size();
      kept.samples.pop_front();
    }
    if (!latch.keyed && sources.size() > kMostWriters) drop_oldest(sources);
  }

  /// By channel and source; an instance goes before its sample.
  template <class Write>
  void write_all(const Write& write) const {
    for (const auto& [channel, sources] : channels_) {
      for (const auto& [source, kept] : sources) {
        if (kept.instance) write(*kept.instance);
        for (const QueuedSample& sample : kept.samples) write(sample);
      }
    }
  }

 private:
  // The depth of a writer's history is not announced. What is large, grids and maps, has depth 1.
  static constexpr std::size_t kMostSamples = 100, kMostBytes = 1u << 20, kMostWriters = 1000;

  struct Kept {
    std::optional<QueuedSample> instance;
    std::deque<QueuedSample> samples;
    std::size_t bytes = 0;
  };
  static QueuedSample copy(const QueuedSample& sample) {
    return {sample.header, sample.payload, std::nullopt};
  }
  static void drop_oldest(std::map<LatchKey, Kept>& sources) {
    const auto newest = [](const auto& entry) {
      const Kept& kept = entry.second;
      return kept.samples.empty() ? 0 : kept.samples.back().header.log_time_ns;
    };
    auto oldest = sources.begin();
    for (auto it = sources.begin(); it != sources.end(); ++it) {
      if (newest(*it) < newest(*oldest)) oldest = it;
    }
    sources.erase(oldest);
  }

  std::map<std::uint16_t, std::map<LatchKey, Kept>> channels_;
};

}  // namespace pocd::dds
