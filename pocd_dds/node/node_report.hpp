// How a node is, in its own words: what health, diagnostics and metrics are made of.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "pocd/map/map_memory.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "pocd_dds/node/health_rule.hpp"
#include "pocd_dds/node/intake.hpp"

namespace pocd::dds {

/// The published map and what it costs.
struct MapTraffic {
  std::uint64_t version = 0;
  std::size_t tiles = 0;
  std::size_t bytes = 0;                             ///< of all tiles that there are
  double area_m2 = 0.0;                              ///< of floor that tiles stand on
  std::uint64_t step_bytes = 0, snapshot_bytes = 0;  ///< payload sent since the start
  std::uint64_t snapshots = 0;
  std::size_t waiting = 0;  ///< messages that the rate holds back
};

/// How the node is.
struct NodeState {
  std::string word = "running";  ///< or "stopped"
  bool ready = false;
  double still_s = 0.0;                ///< of the slowest thread, or of Fast DDS
  std::uint64_t discovery_stalls = 0;  ///< times that Fast DDS's discovery hung
  HealthVerdict verdict;
};

/// What the worker knows.
struct WorkStatus {
  std::uint64_t processed = 0, refused = 0, warnings = 0;
  double processing_ms = 0.0;  ///< mean of the last second, 0 without frames
  std::string last_warning;
  std::uint64_t write_failures = 0;
  std::uint64_t objects = 0;
  MapTraffic map;
  MapMemoryStatus memory;
  std::optional<MemoryStatus> kept;  ///< without a value: nothing is kept
  StampNs stamp_ns = 0;              ///< of the last frame
  /// Longest time of the last second from the last image of a frame to its map delta [ms].
  double latency_ms = 0.0;
  /// CPU time so far [ms]: all threads of the pipeline; publishing; the thread that takes from the
  /// bus, and of that taking and converting images; the whole process. What is left is the
  /// middleware's own threads and run()'s.
  double pipeline_cpu_ms = 0.0, publishing_cpu_ms = 0.0, intake_cpu_ms = 0.0, take_cpu_ms = 0.0,
         process_cpu_ms = 0.0;
};

/// Everything, about once a second.
struct NodeReport {
  IntakeStatus intake;
  WorkStatus work;
  std::size_t queued = 0;           ///< frames that wait now
  std::uint64_t queue_dropped = 0;  ///< that the queue had no room for
  NodeState state;
  bool ending = false;  ///< the node was asked to stop
};

}  // namespace pocd::dds
