// What a node keeps from run to run.
#pragma once

#include <optional>

#include "pocd/memory/warehouse_memory.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/node/look_publication.hpp"
#include "pocd_dds/node/map_publication.hpp"
#include "pocd_dds/node/object_publication.hpp"

namespace pocd::dds {

/// Does nothing when no folder is configured. After restore() for the thread of the pipeline, but
/// for status().
class NodeMemory {
 public:
  /// Takes the folder. Throws InputError.
  explicit NodeMemory(const NodeFile& config);

  /// Of the memory; without one, of the run.
  std::uint64_t lineage(std::uint64_t epoch) const;
  /// Puts what is kept into the pipeline and on the bus, and starts to keep; only when on().
  /// Throws InputError.
  void restore(PocdPipeline& pipeline, MapPublication& map, ObjectPublication& objects,
               LookPublication& looks, std::uint64_t epoch, const std::string& name);

  void add(const FrameResult& result);
  /// The next step is not to wait until its period is over.
  void hurry() { hurried_ = true; }
  /// Something has changed and waits longer than it should: the next step of the map is due.
  bool overdue() const;
  /// Right after a step of the map.
  void step(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns);
  /// The run has ended in order.
  void finish(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns);

  MemoryStatus status() const;
  bool on() const { return memory_.has_value(); }
  /// What could not be kept; from the thread that counts.
  void count_problems(ProblemCounter& problems);

 private:
  const NodeFile config_;
  std::optional<WarehouseMemory> memory_;
  bool changed_ = false, hurried_ = false;
  std::uint64_t failures_counted_ = 0;
  std::uint64_t events_lost_counted_ = 0;
};

}  // namespace pocd::dds
