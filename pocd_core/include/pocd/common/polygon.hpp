// Polygons on the ground.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace pocd {

/// Corners in order [m, W], at least three; the last one is joined to the first. Inside is what an
/// odd number of sides lies beside.
using Polygon = std::vector<Eigen::Vector2d>;

inline bool is_inside(const Polygon& polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[j];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) inside = !inside;
  }
  return inside;
}

/// Whether any part of the straight way from `a` to `b` [m, W] is inside.
inline bool passes_through(const Polygon& polygon, const Eigen::Vector2d& a,
                           const Eigen::Vector2d& b) {
  if (is_inside(polygon, a) || is_inside(polygon, b)) return true;
  const auto side = [](const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                       const Eigen::Vector2d& p) {
    return (to.x() - from.x()) * (p.y() - from.y()) - (to.y() - from.y()) * (p.x() - from.x());
  };
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d &c = polygon[j], &d = polygon[i];
    if ((side(a, b, c) > 0.0) != (side(a, b, d) > 0.0) &&
        (side(c, d, a) > 0.0) != (side(c, d, b) > 0.0)) {
      return true;
    }
  }
  return false;
}

}  // namespace pocd
