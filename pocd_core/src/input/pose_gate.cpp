#include "pocd/input/pose_gate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace pocd {
namespace {

/// A camera's velocity says where it is for so long.
constexpr double kVelocityHolds_s = 0.7;

}  // namespace

bool PoseGate::plausible(const Pose& from, StampNs from_ns, const Pose& to, StampNs to_ns,
                         double& jump_m, double& turn_deg) const {
  const double seconds = std::abs(static_cast<double>(to_ns - from_ns)) * 1e-9;
  jump_m = (to.translation() - from.translation()).norm();
  turn_deg =
      std::abs(Eigen::AngleAxisd(from.linear().transpose() * to.linear()).angle()) * 180.0 / M_PI;
  return jump_m <= config_.slack_m + config_.max_speed_mps * seconds &&
         turn_deg <= config_.slack_deg + config_.max_turn_dps * seconds;
}

bool PoseGate::on_its_way(const Track& track, const Pose& pose, StampNs stamp_ns) const {
  const double seconds = static_cast<double>(stamp_ns - track.accepted_ns) * 1e-9;
  if (!track.velocity_mps || seconds <= 0.0 || seconds > kVelocityHolds_s) return true;
  const auto error_m = [&](const Pose& from, StampNs from_ns) {
    const double s = static_cast<double>(stamp_ns - from_ns) * 1e-9;
    return (pose.translation() - from.translation() - s * *track.velocity_mps).norm();
  };
  const double off_m = error_m(track.accepted, track.accepted_ns);
  // During a jump: still with the refused poses, or back on the way?
  if (track.refused_in_a_row > 0 && error_m(track.refused, track.refused_ns) < off_m) return false;
  return off_m <=
         config_.slack_m + 0.5 * config_.max_acceleration_mps2 * seconds * (seconds + track.step_s);
}

void PoseGate::accept(Track& track, const Pose& pose, StampNs stamp_ns) const {
  const double seconds = static_cast<double>(stamp_ns - track.accepted_ns) * 1e-9;
  track.velocity_mps.reset();
  // After refused frames the speed is that of the jump.
  if (track.accepted_ns > 0 && seconds > 0.0 && seconds <= kVelocityHolds_s &&
      track.refused_in_a_row <= config_.accept_after_frames) {
    track.velocity_mps = (pose.translation() - track.accepted.translation()) / seconds;
    track.step_s = seconds;
  }
  track.accepted = pose;
  track.accepted_ns = stamp_ns;
  track.refused_in_a_row = 0;
}

void PoseGate::forget_oldest_but(const std::string& robot) {
  auto oldest = tracks_.end();
  StampNs oldest_ns = 0;
  for (auto it = tracks_.begin(); it != tracks_.end(); ++it) {
    const StampNs heard_ns = std::max(it->second.accepted_ns, it->second.refused_ns);
    if (it->first == robot || (oldest != tracks_.end() && heard_ns >= oldest_ns)) continue;
    oldest = it;
    oldest_ns = heard_ns;
  }
  forgotten_ = oldest->first;
  tracks_.erase(oldest);
}

std::optional<std::string> PoseGate::refuse(const Frame& frame) {
  forgotten_.reset();
  const auto [it, fresh] = tracks_.try_emplace(frame.robot);
  if (tracks_.size() > kMostRobots) forget_oldest_but(frame.robot);
  Track& track = it->second;
  double jump_m = 0.0, turn_deg = 0.0;
  bool ok = fresh || (plausible(track.accepted, track.accepted_ns, frame.T_W_C, frame.stamp_ns,
                                jump_m, turn_deg) &&
                      on_its_way(track, frame.T_W_C, frame.stamp_ns));
  if (!ok) {
    double step_m = 0.0, step_deg = 0.0;
    const bool agrees =
        track.refused_in_a_row > 0 &&
        plausible(track.refused, track.refused_ns, frame.T_W_C, frame.stamp_ns, step_m, step_deg);
    track.refused_in_a_row = agrees ? track.refused_in_a_row + 1 : 1;
    track.refused = frame.T_W_C;
    track.refused_ns = frame.stamp_ns;
    ok = track.refused_in_a_row > config_.accept_after_frames;
  }
  if (ok) {
    accept(track, frame.T_W_C, frame.stamp_ns);
    return std::nullopt;
  }
  char text[160];
  std::snprintf(text, sizeof(text), "pose jump of %.2f m and %.1f deg in %.2f s", jump_m, turn_deg,
                static_cast<double>(frame.stamp_ns - track.accepted_ns) * 1e-9);
  return (frame.robot.empty() ? "" : frame.robot + ": ") + text;
}

}  // namespace pocd
