// What a node says about itself, for Prometheus.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "pocd_dds/node/node_report.hpp"

namespace prometheus {
class Exposer;
}

namespace pocd::dds {

struct MetricsOptions {
  std::string address;  ///< "HOST:PORT" or "PORT", which is that of 127.0.0.1; port 0: a free one
  std::string node;     ///< value of the label `node`
  std::string version;
  std::uint64_t epoch = 0;
};

/// Serves /metrics by HTTP, with threads of its own, from construction on. The numbers are those of
/// diagnostics (docs/operating.md lists them), of the process those that it has when asked.
class MetricsEndpoint {
 public:
  /// Throws InputError naming the address when it cannot be had.
  explicit MetricsEndpoint(const MetricsOptions& options);
  ~MetricsEndpoint();
  MetricsEndpoint(const MetricsEndpoint&) = delete;
  MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;

  /// Is what is served from now on. Thread-safe.
  void update(const NodeReport& report);
  int port() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
  std::unique_ptr<prometheus::Exposer> exposer_;
};

}  // namespace pocd::dds
