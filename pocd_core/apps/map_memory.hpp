// The memory of an offline run: what it goes on from, and what it leaves.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd/config/run_summary.hpp"
#include "pocd/map/map_delta.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "pocd/output/result_csv.hpp"

namespace pocd {

struct MapMemoryOptions {
  MemoryConfig config;
  bool resume = false;  ///< the inputs are those of the run that was ended: it is taken up again
};

/// Where a run is in its inputs.
struct MapProgress {
  std::uint64_t read = 0;         ///< frames that the reader gave
  std::uint64_t unusable = 0;     ///< of those, not taken by the pipeline
  std::uint64_t first_event = 1;  ///< of the run
  std::uint64_t frames = 0, refused = 0, added = 0, updated = 0, moved = 0, removed = 0;
};

/// Does nothing when no folder is given.
class MapMemory {
 public:
  /// Restores what there is. Throws InputError.
  MapMemory(const MapMemoryOptions& options, const PipelineConfig& config, PocdPipeline& pipeline,
            MapPublisher& publisher);

  /// What the run that is taken up again had done; else a new one.
  const MapProgress& progress() const { return progress_; }
  /// Writes the events that the run had before it was ended.
  void repeat_events(EventsCsv& events, const ClassMap& classes) const;

  void add(const FrameResult& result);
  /// When a step is due. `progress` is after the last frame, whose result gets the time it took:
  /// stages "publish" (the map as a node publishes it) and "memory" (copying what has changed).
  void step(const MapProgress& progress, StampNs stamp_ns, FrameResult& result);
  /// The run has ended. Throws InputError when the memory could not be written.
  void finish(const MapProgress& progress, StampNs stamp_ns);
  /// What it took so far.
  void note(RunSummary& summary) const;
  /// Why nothing is written at present, once.
  std::optional<std::string> take_problem();

 private:
  std::optional<WarehouseMemory> memory_;
  std::filesystem::path folder_;
  PocdPipeline& pipeline_;
  MapPublisher& publisher_;
  MapProgress progress_;
  std::uint64_t failures_told_ = 0;
};

}  // namespace pocd
