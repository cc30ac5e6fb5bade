// The component on the bus: frames in, objects and map out.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "pocd/config/node_config.hpp"
#include "pocd_dds/node/status_publication.hpp"

namespace pocd::dds {

struct NodeOptions {
  BusOptions bus;
  NodeFile config;
  std::uint64_t epoch = 0;   ///< names this run in every identifier; never 0, never used twice
  std::string latency_file;  ///< CSV of the time that each frame took; empty: none
  /// Called about once a second by the thread of run(), with what was sent as health. May be empty.
  std::function<void(const NodeReport&, const pocd_msgs::msg::NodeHealth&)> on_status;
};

/// Owns participant and threads: intake, worker, and one each that writes objects and that draws.
class Node {
 public:
  /// Throws InputError when the bus or the configuration cannot be used.
  explicit Node(const NodeOptions& options);
  ~Node();

  /// Runs until `stop` is true; then stops the intake, processes what is queued, publishes the last
  /// state and waits for subscribers to acknowledge it. False when they did not in time, or when
  /// samples could not be written within the last `node.health_window_s`.
  bool run(const std::atomic<bool>& stop);

  WorkStatus work_status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::dds
