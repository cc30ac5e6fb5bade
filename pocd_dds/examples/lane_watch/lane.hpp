// A lane as a fleet manager may have it: a polyline with a width.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pocd/common/types.hpp"

struct Lane {
  double width_m = 0.0;
  std::vector<double> xy;  // x and y of the points that it leads through
  bool has(const pocd::OrientedBox& box) const {
    double nearest = INFINITY;
    for (std::size_t i = 0; i + 3 < xy.size(); i += 2) {
      const double dx = xy[i + 2] - xy[i], dy = xy[i + 3] - xy[i + 1];
      const double px = box.pose.position_W.x() - xy[i], py = box.pose.position_W.y() - xy[i + 1];
      const double along = (px * dx + py * dy) / std::max(dx * dx + dy * dy, 1e-9);
      const double t = std::clamp(along, 0.0, 1.0);
      nearest = std::min(nearest, std::hypot(px - t * dx, py - t * dy));
    }
    return nearest < 0.5 * (width_m + std::hypot(box.size_m.x(), box.size_m.y()));
  }
};
