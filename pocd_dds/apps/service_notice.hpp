// What systemd is told about a service (sd_notify(3)): nothing when it has not started this
// process.
#pragma once

#include <systemd/sd-daemon.h>

#include <string>

#include "pocd_dds/node/node_report.hpp"

namespace pocd::dds {

/// Not thread-safe.
class ServiceNotice {
 public:
  /// After each status, about once a second: that it is ready, once; a sign of life, unless a
  /// thread hangs; and how it is, for `systemctl status`.
  void tell(const NodeReport& report) {
    const NodeState& state = report.state;
    std::string text = "STATUS=" + (state.verdict.why.empty() ? state.word : state.verdict.why);
    if (state.ready && !told_ready_) {
      text += "\nREADY=1";
      told_ready_ = true;
    }
    if (state.ready || report.ending) text += "\nWATCHDOG=1";
    if (report.ending) text += "\nSTOPPING=1";
    sd_notify(0, text.c_str());
  }

 private:
  bool told_ready_ = false;
};

}  // namespace pocd::dds
