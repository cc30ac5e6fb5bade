// The recent poses of one moving frame, looked up by stamp.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>

#include "pocd/common/types.hpp"
#include "pocd/input/pose_quaternion.hpp"
#include "pocd/input/stamp_order.hpp"

namespace pocd {

/// kTooNew: the stamp lies after the newest pose; a later one may still arrive. kTooOld: before the
/// oldest one kept. kGap: between two poses that are further apart than `max_gap_ns`. kLoop: of
/// TransformTree only.
enum class PoseLookup { kFound, kTooNew, kTooOld, kGap, kEmpty, kLoop };
const char* to_string(PoseLookup result);

/// Not thread-safe.
class PoseBuffer {
 public:
  /// Both bounds in nanoseconds, > 0; capacity in poses, > 1.
  PoseBuffer(StampNs max_gap_ns, std::size_t capacity);

  /// kRefused, and nothing stored, when `stamp_ns` is older than the newest pose; kRestarted: the
  /// poses so far are forgotten. A pose with the newest one's stamp replaces it.
  StampOrder::Verdict add(StampNs stamp_ns, const PoseQuaternion& pose);

  /// The pose at exactly that stamp (bit by bit, where one was stored) or between its neighbours.
  /// Up to `extrapolation_ns` after the newest pose, that newest pose is held.
  PoseLookup at(StampNs stamp_ns, StampNs extrapolation_ns, PoseQuaternion& pose) const;

  /// Of kGap: the stamps of the poses on both sides.
  std::pair<StampNs, StampNs> around(StampNs stamp_ns) const;

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }
  StampNs oldest_ns() const { return entries_.front().stamp_ns; }
  StampNs newest_ns() const { return entries_.back().stamp_ns; }

 private:
  struct Entry {
    StampNs stamp_ns;
    PoseQuaternion pose;
  };
  StampNs max_gap_ns_;
  std::size_t capacity_;
  StampOrder order_;
  std::deque<Entry> entries_;
};

}  // namespace pocd
