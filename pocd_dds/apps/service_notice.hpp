// What systemd is told about a service (sd_notify(3)): nothing when it has not started this
// process.
#pragma once

#include <systemd/sd-daemon.h>

#include <string>

#include "pocd_dds/node/status_publication.hpp"

namespace pocd::dds {

/// Not thread-safe.
class ServiceNotice {
 public:
  /// After each status, about once a second: that it is ready, once; a sign of life, unless a
  /// thread hangs; and how it is, for `systemctl status`.
  void tell(const NodeState& state, bool ending) {
    std::string text = "STATUS=" + (state.verdict.why.empty() ? state.word : state.verdict.why);
    if (state.ready && !told_ready_) {
      text += "\nREADY=1";
      told_ready_ = true;
    }
    if (state.ready || ending) text += "\nWATCHDOG=1";
    if (ending) text += "\nSTOPPING=1";
    sd_notify(0, text.c_str());
  }

 private:
  bool told_ready_ = false;
};

}  // namespace pocd::dds
