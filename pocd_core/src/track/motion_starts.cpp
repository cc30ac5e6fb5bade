#include "motion_starts.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/observe/look.hpp"

namespace pocd {
namespace {

/// Of all motions that put the boxes on each other, so many are aligned: those that bring most of
/// so many points near the old surface.
constexpr std::size_t kStarts = 16;
constexpr std::size_t kStartPoints = 60;

/// So long at most is a thing taken for the one in whose place it stands [s].
constexpr double kMistakenS = 1.0;

/// A length of a thing of which only a part may be known.
double with_room(double length_m, double slack_m) {
  return length_m + std::max(slack_m, 0.25 * length_m);
}

}  // namespace

bool were_both_there(const Departure& departure, const LibraryObject& found, double visit_gap_s,
                     double slack_m) {
  const double together_s = 1e-9 * static_cast<double>(departure.in_place_ns - found.first_seen_ns);
  if (together_s <= 0.0) return false;
  const double until_gone_s =
      1e-9 * static_cast<double>(departure.departed_ns - departure.in_place_ns);
  if (together_s > kMistakenS || until_gone_s > visit_gap_s) return true;
  const auto& surfels = found.model.surfels();
  return std::none_of(surfels.begin(), surfels.end(), [&](const Surfel& s) {
    return is_inside(departure.box, slack_m, s.point_W);
  });
}

bool stands_as_high(const OrientedBox& found, const OrientedBox& known, double slack_m) {
  return known.size_m.z() <= with_room(found.size_m.z(), slack_m);
}

bool is_larger(const OrientedBox& found, const OrientedBox& known, double slack_m) {
  return longest_side(found) > with_room(longest_side(known), slack_m) ||
         found.size_m.z() > with_room(known.size_m.z(), slack_m);
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
