// How the node is doing, on the bus.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <string>

#include "diagnostic_msgsPubSubTypes.h"
#include "pocd/config/node_config.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/node_report.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class StatusPublication {
 public:
  /// Of `outputs`: the rates of diagnostics and of the twins for ROS 2; 0: none.
  StatusPublication(const std::shared_ptr<Participant>& participant, std::string name,
                    std::uint64_t epoch, const RosOutputConfig& outputs);

  /// Health, which is what it returns, is stamped by the wall clock, diagnostics with `now_ns`, the
  /// time of their readers.
  pocd_msgs::msg::NodeHealth send(const NodeReport& report, StampNs now_ns);
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
