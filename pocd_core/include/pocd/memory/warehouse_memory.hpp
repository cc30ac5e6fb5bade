// What a pipeline knows, kept on disk from run to run.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd/map/map_delta.hpp"
#include "pocd/memory/memory_config.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {

/// A run that writes to a memory.
struct MemoryRun {
  std::uint64_t epoch = 0;  ///< its name on the bus; 0: it has none
  std::string program;      ///< name and version
  StampNs started_ns = 0;   ///< wall clock
};

/// Counts are of this run.
struct MemoryStatus {
  std::uint64_t steps = 0;           ///< written
  std::uint64_t failures = 0;        ///< times that a step could not be written
  std::string problem;               ///< why the last one could not; empty: it was written
  bool stopped = false;              ///< nothing is written any more
  std::size_t events_waiting = 0;    ///< for the next step
  std::uint64_t events_lost = 0;     ///< too many waited, or nothing is written any more
  StampNs stored_stamp_ns = 0;       ///< everything up to this frame is on disk
  std::uint64_t stored_version = 0;  ///< of the published map
  std::uint64_t stored_event = 0;    ///< the last one in the log
  std::uint64_t file_bytes = 0;      ///< database and its log of changes
  std::uint64_t written_bytes = 0;   ///< handed to the database: rows, before its own pages
  double write_ms = 0.0;             ///< the last step, on the writer's thread
  /// CPU time of all steps [ms]: copying on the pipeline's thread, writing on the writer's.
  double gather_cpu_ms = 0.0, write_cpu_ms = 0.0;
};

/// One folder, one process at a time. The thread of the pipeline gathers what has changed; a thread
/// of its own writes it, one transaction per step, so that the disk never holds up a frame. When
/// the disk takes nothing, the step is tried again every second, and what changes meanwhile goes
/// into the next one. A process that is killed loses what was not written: at most what changed
/// since the last step, and that one.
class WarehouseMemory {
 public:
  /// So many events wait for a disk that takes nothing; after that the oldest are lost.
  static constexpr std::size_t kMostWaiting = 50'000;

  /// Takes the folder, made when it is missing. Throws InputError when it is in use or cannot be
  /// written, when the file is damaged or of another version, or when its map is of another kind
  /// than `map`.
  WarehouseMemory(const MemoryConfig& config, const TsdfConfig& map);
  ~WarehouseMemory();
  WarehouseMemory(const WarehouseMemory&) = delete;
  WarehouseMemory& operator=(const WarehouseMemory&) = delete;

  /// Names the memory; drawn when it was made.
  std::uint64_t lineage() const;
  /// There is something to go on from.
  bool holds_something() const;
  /// The last run ended in order.
  bool ended_clean() const;
  /// The last frame that is in the memory.
  StampNs stamp_ns() const;
  /// Numbers below these may have been used by the last run after its last step: who does not take
  /// the same frames again leaves them out (PocdPipeline::skip_to).
  PocdPipeline::Numbers reserved() const;
  /// What the last step was given as progress.
  const std::vector<std::uint8_t>& progress() const;

  /// Puts what is kept into a pipeline and a publisher that know nothing yet. Voxels follow when
  /// they are needed. Throws InputError, naming what is damaged.
  void restore(PocdPipeline& pipeline, MapPublisher& publisher);
  /// Starts to write, and to note when regions are looked at. Names of classes are kept for who
  /// reads the log.
  void start(PocdPipeline& pipeline, const ClassMap& classes, const MemoryRun& run);

  // The pipeline's thread:

  /// Events go to the log with the next step.
  void add(const FrameResult& result);
  /// The step before has been written.
  bool free() const;
  /// The same, and the period is over.
  bool due() const;
  /// Takes over what has changed. Right after MapPublisher::take_over(), before the next frame.
  /// Waits for the step before.
  void step(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns,
            std::vector<std::uint8_t> progress = {});
  /// The last step: the run has ended in order. False when it could not be written.
  bool finish(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns,
              std::vector<std::uint8_t> progress = {});

  /// Any thread.
  MemoryStatus status() const;
  /// Called by the writer's thread when a step is on disk.
  void on_stored(std::function<void()> called);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd
