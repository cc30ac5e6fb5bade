// Whether the frames of all robots go on in time.
#pragma once

#include <algorithm>
#include <optional>

#include "pocd/input/stamp_order.hpp"

namespace pocd {

/// Frames come in the order of their stamps, or nearly. One that lies far behind is of a robot
/// whose clock is wrong, or all clocks were set back (a replay that starts again): the latter when
/// so many frames in a row lie there, as StampOrder asks of one stream.
class FrameClock {
 public:
  /// Far more than any merging of robots puts frames out of order.
  static constexpr StampNs kFarBehind = 10'000'000'000;

  enum class Verdict { kGoesOn, kBehind, kSetBack };
  Verdict judge(StampNs stamp_ns) {
    if (!newest_ns_ || *newest_ns_ - stamp_ns <= kFarBehind) {
      newest_ns_ = std::max(newest_ns_.value_or(stamp_ns), stamp_ns);
      behind_ = 0;
      return Verdict::kGoesOn;
    }
    if (++behind_ < StampOrder::kAgreeing) return Verdict::kBehind;
    newest_ns_ = stamp_ns;
    behind_ = 0;
    return Verdict::kSetBack;
  }
  /// Of the frames that were not behind.
  StampNs newest_ns() const { return newest_ns_.value_or(0); }

 private:
  friend struct ArchiveAccess;
  std::optional<StampNs> newest_ns_;
  int behind_ = 0;
};

}  // namespace pocd
