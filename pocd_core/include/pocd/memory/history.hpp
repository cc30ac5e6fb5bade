// What the log of a memory says about the past.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "pocd/memory/memory_reader.hpp"

namespace pocd {

/// What stood where at a time, by the last event about each object.
using HistoryState = std::map<ObjectId, LoggedEvent>;

enum class DifferenceKind { kAdded, kMoved, kChanged, kRemoved };
const char* to_string(DifferenceKind kind);  ///< "ADDED", "MOVED", "CHANGED", "REMOVED"

struct Difference {
  DifferenceKind kind = DifferenceKind::kAdded;
  LoggedEvent evidence;               ///< the last event that made it so
  std::optional<OrientedBox> before;  ///< where it stood at the first time; none: ADDED
};

/// Reads the log in steps; memory follows the number of objects. Not thread-safe.
class History {
 public:
  explicit History(MemoryReader& log) : log_(log) {}

  /// All events with stamps up to `time_ns`, in the order in which they were seen. Throws
  /// InputError when events from before that time were dropped.
  HistoryState state_at(StampNs time_ns);
  /// What is different at `to_ns` from `from_ns`, by object. An object whose box is the same to
  /// `least_m` in place and size is not listed. Throws InputError as state_at().
  std::vector<Difference> between(StampNs from_ns, StampNs to_ns, double least_m);
  /// Every event about the object, and about those that turned out to be it, by number.
  std::vector<LoggedEvent> life_of(ObjectId id);

 private:
  template <class Visit>
  void for_each_event(const Visit& visit);
  MemoryReader& log_;
};

}  // namespace pocd
