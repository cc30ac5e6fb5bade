#include "pocd/input/pose_buffer.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"

namespace pocd {

const char* to_string(PoseLookup result) {
  switch (result) {
    case PoseLookup::kFound:
      return "found";
    case PoseLookup::kTooNew:
      return "newer than the newest pose";
    case PoseLookup::kTooOld:
      return "older than the oldest pose";
    case PoseLookup::kGap:
      return "in a gap of the poses";
    case PoseLookup::kEmpty:
      return "without any pose";
    case PoseLookup::kLoop:
      return "in a loop of frames";
  }
  return "";
}

PoseBuffer::PoseBuffer(StampNs max_gap_ns, std::size_t capacity)
    : max_gap_ns_(max_gap_ns), capacity_(capacity) {
  POCD_CHECK(max_gap_ns > 0 && capacity > 1);
}

StampOrder::Verdict PoseBuffer::add(StampNs stamp_ns, const PoseQuaternion& pose) {
  if (!entries_.empty() && stamp_ns == entries_.back().stamp_ns) {
    entries_.back().pose = pose;
    return StampOrder::Verdict::kAccepted;
  }
  const StampOrder::Verdict verdict = order_.judge(stamp_ns);
  if (verdict == StampOrder::Verdict::kRefused) return verdict;
  // Nothing is interpolated from one clock into another.
  if (verdict == StampOrder::Verdict::kRestarted) entries_.clear();
  entries_.push_back({stamp_ns, pose});
  if (entries_.size() > capacity_) entries_.pop_front();
  return verdict;
}

std::pair<StampNs, StampNs> PoseBuffer::around(StampNs stamp_ns) const {
  const auto after = std::lower_bound(entries_.begin(), entries_.end(), stamp_ns,
                                      [](const Entry& e, StampNs s) { return e.stamp_ns < s; });
  POCD_CHECK(after != entries_.begin() && after != entries_.end());
  return {(after - 1)->stamp_ns, after->stamp_ns};
}

PoseLookup PoseBuffer::at(StampNs stamp_ns, StampNs extrapolation_ns, PoseQuaternion& pose) const {
  if (entries_.empty()) return PoseLookup::kEmpty;
  if (stamp_ns < entries_.front().stamp_ns) return PoseLookup::kTooOld;
  const auto after = std::lower_bound(entries_.begin(), entries_.end(), stamp_ns,
                                      [](const Entry& e, StampNs s) { return e.stamp_ns < s; });
  if (after == entries_.end()) {
    if (stamp_ns - entries_.back().stamp_ns > extrapolation_ns) return PoseLookup::kTooNew;
    pose = entries_.back().pose;
    return PoseLookup::kFound;
  }
  if (after->stamp_ns == stamp_ns) {
    pose = after->pose;
    return PoseLookup::kFound;
  }
  const auto before = after - 1;
  const StampNs span_ns = after->stamp_ns - before->stamp_ns;
  if (span_ns > max_gap_ns_) return PoseLookup::kGap;
  const double t = static_cast<double>(stamp_ns - before->stamp_ns) / static_cast<double>(span_ns);
  pose = interpolate(before->pose, after->pose, t);
  return PoseLookup::kFound;
}

}  // namespace pocd
