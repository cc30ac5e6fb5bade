#include "pocd/sim/robot_path.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

double heading(const Eigen::Vector2d& direction) {
  return std::atan2(direction.y(), direction.x());
}

/// Turn from one direction to the next, in (-pi, pi].
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

}  // namespace

void RobotPath::add_line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double speed_m_s) {
  const double length = (to - from).norm();
  if (length < 1e-9) return;
  const double yaw_rad = heading(to - from);
  pieces_.push_back({length / speed_m_s, from, to, yaw_rad, yaw_rad});
}

RobotPath::RobotPath(const PathSpec& spec, const std::string& source) {
  const auto& points = spec.waypoints_m;
  const int n = static_cast<int>(points.size());
  const auto require = [&](bool good, const std::string& what) {
    if (!good) throw InputError(source + ": path " + what);
  };
  require(n >= 2, "needs at least 2 waypoints, has " + std::to_string(n));
  require(spec.speed_m_s > 0.0, "speed_m_s must be > 0");
  require(spec.turn_rate_rad_s > 0.0, "turn rate must be > 0");
  require(spec.corner_radius_m >= 0.0, "corner_radius_m must be >= 0");
  require(spec.laps >= 1, "laps must be >= 1");

  const int edges = spec.closed ? n : n - 1;
  const auto direction = [&](int edge) -> Eigen::Vector2d {
    return (points[(edge + 1) % n] - points[edge % n]).normalized();
  };
  const auto length = [&](int edge) { return (points[(edge + 1) % n] - points[edge % n]).norm(); };
  // How much of the two edges at the start of an edge its corner's arc takes.
  const auto cut = [&](int edge) {
    if (!spec.closed && edge == 0) return 0.0;
    const double angle = turn(direction((edge + edges - 1) % edges), direction(edge));
    return spec.corner_radius_m * std::tan(0.5 * std::abs(angle));
  };
  for (int edge = 0; edge < edges; ++edge) {
    require(length(edge) > 1e-6, "waypoint " + std::to_string(edge) + " repeats the next one");
  }
  double start_left_m = spec.closed ? spec.start_m : 0.0;
  bool start_found = false;
  for (int edge = 0; edge < edges; ++edge) {
    const bool turns = spec.closed || edge + 1 < edges;
    const double before = cut(edge), after = turns ? cut((edge + 1) % edges) : 0.0;
    require(before + after <= length(edge) + 1e-9,
            "corner_radius_m does not fit on edge " + std::to_string(edge));
    const Eigen::Vector2d a = points[edge] + before * direction(edge);
    const Eigen::Vector2d b = points[(edge + 1) % n] - after * direction(edge);
    if (!start_found && start_left_m <= length(edge)) {
      // A lap that starts on a corner's arc starts at the arc's nearer end.
      double begin_s = 0.0;
      for (const Piece& piece : pieces_) begin_s += piece.duration_s;
      start_s_ = begin_s + std::clamp(start_left_m - before, 0.0, (b - a).norm()) / spec.speed_m_s;
      start_found = true;
    }
    start_left_m -= length(edge);
    add_line(a, b, spec.speed_m_s);
    if (!turns) continue;
    const Eigen::Vector2d next = direction((edge + 1) % edges);
    const double angle = turn(direction(edge), next);
    if (std::abs(angle) < 1e-9) continue;
    Piece arc;
    arc.from = b;
    arc.to = points[(edge + 1) % n] + after * next;
    arc.yaw0_rad = heading(direction(edge));
    arc.yaw1_rad = arc.yaw0_rad + angle;
    arc.signed_radius_m = std::copysign(spec.corner_radius_m, angle);
    arc.duration_s = std::abs(angle) *
                     std::max(1.0 / spec.turn_rate_rad_s, spec.corner_radius_m / spec.speed_m_s);
    pieces_.push_back(arc);
  }
  require(!spec.closed || (start_found && spec.start_m >= 0.0), "start_m is not on the path");
  for (const Piece& piece : pieces_) lap_s_ += piece.duration_s;
  laps_ = spec.closed ? spec.laps : 1;
  duration_s_ = laps_ * lap_s_;
}

Pose RobotPath::base_at(double time_s) const {
  double t = std::fmod(std::clamp(time_s, 0.0, duration_s_) + start_s_, lap_s_);
  if (start_s_ == 0.0 && time_s >= duration_s_) t = lap_s_;
  const Piece* piece = &pieces_.front();
  for (const Piece& candidate : pieces_) {
    piece = &candidate;
    if (t <= candidate.duration_s) break;
    t -= candidate.duration_s;
  }
  const double part = std::clamp(t / piece->duration_s, 0.0, 1.0);
  const double yaw_rad = piece->yaw0_rad + part * (piece->yaw1_rad - piece->yaw0_rad);
  Eigen::Vector2d position = piece->from + part * (piece->to - piece->from);
  if (piece->signed_radius_m != 0.0) {
    const auto left = [](double yaw) { return Eigen::Vector2d(-std::sin(yaw), std::cos(yaw)); };
    const Eigen::Vector2d centre = piece->from + piece->signed_radius_m * left(piece->yaw0_rad);
    position = centre - piece->signed_radius_m * left(yaw_rad);
  }
  Pose T_W_B = Pose::Identity();
  T_W_B.translation() << position, 0.0;
  T_W_B.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T_W_B;
}

}  // namespace pocd
