// Where the memory of a warehouse is, and how much of its past is kept.
#pragma once

#include <string>

#include "pocd/common/describe.hpp"

namespace pocd {

struct MemoryConfig {
  std::string folder;
  double period_s = 1.0;
  double keep_events_days = 400.0;
  int keep_events_mb = 1000;

  bool on() const { return !folder.empty(); }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("folder", folder,
          "Folder of the memory, made when it is missing; empty: nothing is kept beyond a run.");
    visit("period_s", period_s, Range{0.0, 60.0},
          "Least time between two steps that are written down: what a kill may cost [s].");
    visit("keep_events_days", keep_events_days, Range{0.01, 100000.0},
          "Events older than this, against the newest, are dropped from the log [days].");
    visit("keep_events_mb", keep_events_mb, Range{1, 1000000},
          "Size of the log of events above which the oldest are dropped [MB].");
  }
};

}  // namespace pocd
