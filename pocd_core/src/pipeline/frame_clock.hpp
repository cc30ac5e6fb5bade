// Whether the frames of all robots go on in time.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "pocd/input/pose_gate.hpp"
#include "pocd/input/stamp_order.hpp"

namespace pocd {

/// Frames come in the order of their stamps, or nearly. One that lies far off is of a robot whose
/// clock is wrong, or time has gone on (everything paused) or was set back (a replay that starts
/// again). More robots agree with what is right than with what is wrong: the clock follows a far
/// stamp only when more of the robots heard lately are near it than near the clock; backwards only
/// when they have said so in as many frames as StampOrder asks of one stream. Of two robots that
/// disagree, the one is right whose frames went on first.
class FrameClock {
 public:
  /// Far more than any merging of robots puts frames out of order.
  static constexpr StampNs kFar = 10'000'000'000;

  enum class Verdict { kGoesOn, kBehind, kAhead, kSetBack };
  Verdict judge(const std::string& robot, StampNs stamp_ns) {
    ++frames_;
    forget_silent();
    Heard& own = robots_[robot];
    own.stamp_ns = stamp_ns;
    own.frame = frames_;
    if (robots_.size() > PoseGate::kMostRobots) forget_oldest();
    if (!newest_ns_ || near(stamp_ns, *newest_ns_)) {
      newest_ns_ = std::max(newest_ns_.value_or(stamp_ns), stamp_ns);
      own.off_in_a_row = 0;
      return Verdict::kGoesOn;
    }
    ++own.off_in_a_row;
    const bool ahead = stamp_ns > *newest_ns_;
    int agree = 0, disagree = 0, agreeing_frames = 0;
    for (const auto& [name, heard] : robots_) {
      if (near(heard.stamp_ns, stamp_ns)) {
        ++agree;
        agreeing_frames += heard.off_in_a_row;
      } else if (near(heard.stamp_ns, *newest_ns_)) {
        ++disagree;
      }
    }
    const bool follow = agree > disagree && (ahead || agreeing_frames >= StampOrder::kAgreeing);
    if (!follow) return ahead ? Verdict::kAhead : Verdict::kBehind;
    newest_ns_ = stamp_ns;
    for (auto& [name, heard] : robots_) {
      if (near(heard.stamp_ns, stamp_ns)) heard.off_in_a_row = 0;
    }
    return ahead ? Verdict::kGoesOn : Verdict::kSetBack;
  }
  /// Of the frames that were used.
  StampNs newest_ns() const { return newest_ns_.value_or(0); }
  /// That have a voice: at most PoseGate::kMostRobots.
  std::size_t robots() const { return robots_.size(); }

 private:
  friend struct ArchiveAccess;
  struct Heard {
    StampNs stamp_ns = 0;
    std::uint64_t frame = 0;  ///< number, over all robots
    int off_in_a_row = 0;
  };
  static bool near(StampNs a, StampNs b) {
    // Stamps may be anything: their difference need not fit.
    return std::abs(static_cast<double>(a) - static_cast<double>(b)) <= static_cast<double>(kFar);
  }
  /// A robot has no voice when all others together have sent ten frames each without it.
  void forget_silent() {
    const std::uint64_t lately = StampOrder::kAgreeing * robots_.size();
    for (auto heard = robots_.begin(); heard != robots_.end();) {
      heard = frames_ - heard->second.frame > lately ? robots_.erase(heard) : std::next(heard);
    }
  }

  void forget_oldest() {
    robots_.erase(std::min_element(
        robots_.begin(), robots_.end(),
        [](const auto& a, const auto& b) { return a.second.frame < b.second.frame; }));
  }

  std::optional<StampNs> newest_ns_;
  std::map<std::string, Heard> robots_;
  std::uint64_t frames_ = 0;
};

}  // namespace pocd
