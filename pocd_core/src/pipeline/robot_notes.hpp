// What the pipeline keeps of each robot from frame to frame.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>

#include "pocd/common/types.hpp"
#include "pocd/segmentation/planes.hpp"

namespace pocd {

// Names may be many: the pipeline forgets those that the pose gate forgets.

/// The ground under each robot, or camera with a name of its own: floors of two storeys, and poses
/// that are off by some centimetres, are another one's affair. Not thread-safe.
class Grounds {
 public:
  GroundModel& of(const std::string& robot) { return by_robot_[robot]; }
  void forget(const std::string& robot) { by_robot_.erase(robot); }
  void clear() { by_robot_.clear(); }

 private:
  friend struct ArchiveAccess;
  std::map<std::string, GroundModel> by_robot_;
};

/// Which robots send masks. One that does may lose the mask of a frame: nothing is learnt of things
/// from that one. When masks have been missing in all of its frames for kEnded, its network is
/// gone: it goes on as a robot that never sent any, and with masks when they are back. Not
/// thread-safe.
class MaskWatch {
 public:
  /// Longer than a segmentation network takes to start again; things that come and go meanwhile are
  /// told late.
  static constexpr StampNs kEnded = 30'000'000'000;

  enum class Masks {
    kUsed,     ///< the frame has one
    kMissing,  ///< the robot sends masks, but none with this frame
    kEnd,      ///< the first frame of a robot that does not send them any more
    kNone,     ///< the robot sends none
  };
  Masks judge(const std::string& robot, StampNs stamp_ns, bool has_mask) {
    if (has_mask) {
      robots_[robot].missing_since_ns.reset();
      return Masks::kUsed;
    }
    const auto found = robots_.find(robot);
    if (found == robots_.end()) return Masks::kNone;
    StampNs& since_ns = found->second.missing_since_ns.emplace(
        std::min(found->second.missing_since_ns.value_or(stamp_ns), stamp_ns));
    if (stamp_ns - since_ns < kEnded) return Masks::kMissing;
    robots_.erase(found);
    return Masks::kEnd;
  }
  void forget(const std::string& robot) { robots_.erase(robot); }

 private:
  friend struct ArchiveAccess;
  struct Sends {
    std::optional<StampNs> missing_since_ns;  ///< in all frames since then
  };
  std::map<std::string, Sends> robots_;
};

}  // namespace pocd
