#include "motion_starts.hpp"

#include <algorithm>
#include <cmath>

namespace pocd {
namespace {

/// Of all motions that put the boxes on each other, so many are aligned: those that bring most of
/// so many points near the old surface.
constexpr std::size_t kStarts = 16;
constexpr std::size_t kStartPoints = 60;

}  // namespace

bool may_be(const OrientedBox& found, const OrientedBox& known, double slack_m) {
  const auto sorted = [](const OrientedBox& box) {
    const double x = box.size_m.x(), y = box.size_m.y();
    return Eigen::Vector3d(std::max(x, y), std::min(x, y), box.size_m.z());
  };
  const Eigen::Vector3d f = sorted(found), k = sorted(known);
  const auto room = [&](double x) { return x + std::max(slack_m, 0.25 * x); };
  return f[0] <= room(k[0]) && f[1] <= room(k[0]) && f[2] <= room(k[2]) && k[2] <= room(f[2]);
}

std::vector<Pose> likely_starts(const OrientedBox& known, const OrientedBox& found,
                                const IcpTarget& target, const Points& source) {
  const Eigen::Vector3d origin_W = target.origin_W();
  const std::size_t step = std::max<std::size_t>(1, source.size() / kStartPoints);
  std::vector<std::pair<int, Pose>> starts;
  const auto add = [&](const Pose& start) {
    int on = 0;
    for (std::size_t i = 0; i < source.size(); i += step) {
      const Eigen::Vector3d p = start * source[i].cast<double>();
      on += target.nearest((p - origin_W).cast<float>()).has_value();
    }
    starts.emplace_back(on, start);
  };
  add(Pose::Identity());
  const Eigen::AngleAxisd heading(known.pose.yaw_rad, Eigen::Vector3d::UnitZ());
  for (int quarter = -1; quarter < 4; ++quarter) {
    const double turn_rad =
        quarter < 0 ? 0.0 : known.pose.yaw_rad - found.pose.yaw_rad + quarter * M_PI / 2.0;
    Pose start = Pose::Identity();
    start.linear() = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    // Sides of the found box, turned, along those of the known one.
    const double off_rad = found.pose.yaw_rad + turn_rad - known.pose.yaw_rad;
    const double c = std::abs(std::cos(off_rad)), s = std::abs(std::sin(off_rad));
    const double play_x = 0.5 * (known.size_m.x() - c * found.size_m.x() - s * found.size_m.y());
    const double play_y = 0.5 * (known.size_m.y() - s * found.size_m.x() - c * found.size_m.y());
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        start.translation() = known.pose.position_W +
                              heading * Eigen::Vector3d(x * play_x, y * play_y, 0.0) -
                              start.linear() * found.pose.position_W;
        add(start);
      }
    }
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Pose> likely;
  for (const auto& [on, start] : starts) {
    if (likely.size() < kStarts) likely.push_back(start);
  }
  return likely;
}

}  // namespace pocd
