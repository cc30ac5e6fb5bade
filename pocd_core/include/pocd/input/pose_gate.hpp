// Refuses frames whose pose cannot be true: a bad pose looks like a change of everything.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "pocd/common/describe.hpp"
#include "pocd/input/frame.hpp"

namespace pocd {

struct PoseGateConfig {
  double max_speed_mps = 3.0;
  double max_turn_dps = 180.0;
  double max_acceleration_mps2 = 10.0;
  double slack_m = 0.10;
  double slack_deg = 5.0;
  int accept_after_frames = 15;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("max_speed_mps", max_speed_mps, Range{0.01, 100.0},
          "Fastest plausible motion of a camera [m/s].");
    visit("max_turn_dps", max_turn_dps, Range{1.0, 10000.0}, "Fastest plausible rotation [deg/s].");
    visit("max_acceleration_mps2", max_acceleration_mps2, Range{0.1, 10000.0},
          "Strongest plausible change of a camera's velocity: a jump too short for the speed to "
          "tell is "
          "off the way that the last frames led [m/s2].");
    visit("slack_m", slack_m, Range{0.0, 100.0}, "Jump that is accepted at any rate [m].");
    visit("slack_deg", slack_deg, Range{0.0, 360.0}, "Turn that is accepted at any rate [deg].");
    visit("accept_after_frames", accept_after_frames, Range{1, 100000},
          "After this many refused frames that agree with each other the robot is where they say.");
  }
};

/// One gate for all robots; keeps the last accepted pose of each of the kMostRobots that were heard
/// of last: names may be many, and one that comes back is as new. Not thread-safe.
class PoseGate {
 public:
  explicit PoseGate(const PoseGateConfig& config) : config_(config) {}

  /// Nothing when the pose may be used, else a line that says why not, e.g.
  /// "robot1: pose jump of 0.31 m and 2.0 deg in 0.07 s".
  std::optional<std::string> refuse(const Frame& frame);

  static constexpr std::size_t kMostRobots = 1000;
  std::size_t robots() const { return tracks_.size(); }
  /// The robot that the last call of refuse() forgot, if any; asked once.
  std::optional<std::string> take_forgotten() { return std::exchange(forgotten_, std::nullopt); }

 private:
  friend struct ArchiveAccess;
  struct Track {
    Pose accepted = Pose::Identity();
    StampNs accepted_ns = 0;
    /// Over the last two accepted poses, when they were near in time.
    std::optional<Eigen::Vector3d> velocity_mps;
    double step_s = 0.0;  ///< between those two
    Pose refused = Pose::Identity();
    StampNs refused_ns = 0;
    int refused_in_a_row = 0;
  };
  bool plausible(const Pose& from, StampNs from_ns, const Pose& to, StampNs to_ns, double& jump_m,
                 double& turn_deg) const;

  /// Whether the pose lies on the way that the accepted poses led.
  bool on_its_way(const Track& track, const Pose& pose, StampNs stamp_ns) const;
  void forget_oldest_but(const std::string& robot);
  void accept(Track& track, const Pose& pose, StampNs stamp_ns) const;

  PoseGateConfig config_;
  std::map<std::string, Track> tracks_;
  std::optional<std::string> forgotten_;
};

}  // namespace pocd
