// Where a robot's base is at a time: straight lines with turns at the corners of a polygon.
#pragma once

#include <vector>

#include "pocd/common/types.hpp"

namespace pocd {

struct PathSpec {
  std::vector<Eigen::Vector2d> waypoints_m;  ///< at least two, consecutive ones distinct
  bool closed = true;                        ///< back to the first waypoint, laps times
  double speed_m_s = 0.8;
  double turn_rate_rad_s = 1.2;  ///< limit of the turning speed
  double corner_radius_m = 0.0;  ///< 0: stops and turns on the spot
  double start_m = 0.0;          ///< closed paths: the lap starts this far after the first waypoint
  int laps = 1;                  ///< closed paths only
};

/// Heading is the direction of travel. On arcs the speed is the lower of speed_m_s and what
/// turn_rate_rad_s allows. A lap ends where it began. Thread-safe once built.
class RobotPath {
 public:
  /// Throws InputError naming `source` for an impossible path: too few or repeated waypoints,
  /// speeds not above 0, a corner radius that does not fit between two corners.
  RobotPath(const PathSpec& spec, const std::string& source);

  double duration_s() const { return duration_s_; }
  /// Base on the floor (z = 0) at time_s, clamped to [0, duration_s].
  Pose base_at(double time_s) const;

 private:
  struct Piece {
    double duration_s;
    Eigen::Vector2d from, to;      // line; for a turn on the spot from == to
    double yaw0_rad, yaw1_rad;     // equal on a line
    double signed_radius_m = 0.0;  // of an arc, > 0 to the left
  };
  void add_line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double speed_m_s);

  std::vector<Piece> pieces_;  // one lap
  int laps_ = 1;
  double lap_s_ = 0.0;
  double start_s_ = 0.0;
  double duration_s_ = 0.0;
};

}  // namespace pocd
