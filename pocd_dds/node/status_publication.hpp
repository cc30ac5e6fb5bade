// How the node is doing, on the bus.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "diagnostic_msgsPubSubTypes.h"
#include "pocd/config/node_config.hpp"
#include "pocd/map/map_memory.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/health_rule.hpp"
#include "pocd_dds/node/intake.hpp"
#include "pocd_msgsPubSubTypes.h"

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
  double still_s = 0.0;  ///< of the slowest thread
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

/// Not thread-safe.
class StatusPublication {
 public:
  /// Of `outputs`: the rates of diagnostics and of the twins for ROS 2; 0: none.
  StatusPublication(const std::shared_ptr<Participant>& participant, std::string name,
                    std::uint64_t epoch, const RosOutputConfig& outputs);

  /// Health is stamped by the wall clock, diagnostics with `now_ns`, the time of their readers.
  void send(const IntakeStatus& intake, const WorkStatus& work, std::size_t queued,
            std::uint64_t queue_dropped, const NodeState& state, StampNs now_ns);
  /// Health only: it says how the node ended.
  bool wait_acknowledged(std::chrono::steady_clock::time_point end) {
    return health_.wait_acknowledged(end);
  }

 private:
  std::string name_;
  std::uint64_t epoch_;
  std::uint64_t map_bytes_ = 0;  // sent at the time of the status before
  std::chrono::steady_clock::time_point sent_{};
  Writer<pocd_msgs::msg::NodeHealthPubSubType> health_;
  std::unique_ptr<RenamedWriter<pocd_msgs::msg::NodeHealthPubSubType>> ros_health_;
  std::unique_ptr<Writer<diagnostic_msgs::msg::DiagnosticArrayPubSubType>> diagnostics_;
  double diagnostics_period_s_ = 0.0;
  std::chrono::steady_clock::time_point diagnostics_sent_{};
};

}  // namespace pocd::dds
