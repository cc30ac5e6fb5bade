#include "pocd/map/view_memory.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pocd {
namespace {

constexpr double kCell_m = 0.5;
constexpr int kOctants = 8;
/// Pixels of the strided grid per tile of a thumbnail, each way.
constexpr int kTile = 8;
constexpr std::size_t kPoints = 200;

std::uint64_t key_of(std::int64_t x, std::int64_t y, int octant) {
  constexpr std::int64_t kHalf = std::int64_t{1} << 29;
  return (static_cast<std::uint64_t>(x + kHalf) << 34) |
         (static_cast<std::uint64_t>(y + kHalf) << 4) | static_cast<std::uint64_t>(octant);
}

std::int64_t cell(double v) { return static_cast<std::int64_t>(std::floor(v / kCell_m)); }

int octant_of(const Pose& T_W_C) {
  const Eigen::Vector3d axis_W = T_W_C.linear().col(2);
  const double turn = std::atan2(axis_W.y(), axis_W.x()) / (2.0 * M_PI) + 1.0;
  return static_cast<int>(std::floor(turn * kOctants)) % kOctants;
}

}  // namespace

void ViewMemory::add(const OrganizedCloud& cloud, StampNs stamp_ns) {
  const Eigen::Vector3d eye_W = cloud.T_W_C.translation();
  const std::uint64_t key = key_of(cell(eye_W.x()), cell(eye_W.y()), octant_of(cloud.T_W_C));
  auto& kept = views_[key];
  if (!kept.empty() && stamp_ns - kept.back().stamp_ns < kRenew_ns) return;
  if (kept.size() == 2) kept.erase(kept.begin());
  View view;
  view.stamp_ns = stamp_ns;
  view.T_C_W = cloud.T_W_C.inverse();
  view.camera = cloud.camera;
  view.camera.width = cloud.width / kTile;
  view.camera.height = cloud.height / kTile;
  view.nearest_m.assign(static_cast<std::size_t>(view.camera.width) * view.camera.height, 0.0f);
  for (int row = 0; row < view.camera.height * kTile; ++row) {
    for (int col = 0; col < view.camera.width * kTile; ++col) {
      const float z = cloud.depth_m[static_cast<std::size_t>(row) * cloud.width + col];
      float& nearest =
          view.nearest_m[static_cast<std::size_t>(row / kTile) * view.camera.width + col / kTile];
      if (z > 0.0f && (nearest == 0.0f || z < nearest)) nearest = z;
    }
  }
  kept.push_back(std::move(view));
  if (notes_changes_) changed_.insert(key);
}

double ViewMemory::seen_empty_share(const Points& points_W, StampNs before_ns, double max_depth_m,
                                    double margin_m) const {
  if (points_W.empty()) return 0.0;
  const std::size_t step = std::max<std::size_t>(1, points_W.size() / kPoints);
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d low_W = points_W[0].cast<double>(), high_W = low_W;
  for (std::size_t i = 0; i < points_W.size(); i += step) {
    points.push_back(points_W[i].cast<double>());
    low_W = low_W.cwiseMin(points.back());
    high_W = high_W.cwiseMax(points.back());
  }
  std::vector<bool> in_picture(points.size(), false), empty(points.size(), false);
  for (std::int64_t x = cell(low_W.x() - max_depth_m); x <= cell(high_W.x() + max_depth_m); ++x) {
    for (std::int64_t y = cell(low_W.y() - max_depth_m); y <= cell(high_W.y() + max_depth_m); ++y) {
      for (int octant = 0; octant < kOctants; ++octant) {
        const auto it = views_.find(key_of(x, y, octant));
        if (it == views_.end()) continue;
        for (const View& view : it->second) {
          if (view.stamp_ns >= before_ns) continue;
          for (std::size_t i = 0; i < points.size(); ++i) {
            if (empty[i]) continue;
            const Eigen::Vector3d p_C = view.T_C_W * points[i];
            if (p_C.z() < 0.1 || p_C.z() > max_depth_m) continue;
            const double u = view.camera.fx * p_C.x() / p_C.z() + view.camera.cx;
            const double v = view.camera.fy * p_C.y() / p_C.z() + view.camera.cy;
            const int col = static_cast<int>(std::floor(u)) / kTile;
            const int row = static_cast<int>(std::floor(v)) / kTile;
            if (u < 0.0 || v < 0.0 || col >= view.camera.width || row >= view.camera.height)
              continue;
            const float nearest =
                view.nearest_m[static_cast<std::size_t>(row) * view.camera.width + col];
            if (nearest == 0.0f) continue;
            in_picture[i] = true;
            empty[i] = nearest > p_C.z() + margin_m;
          }
        }
      }
    }
  }
  const auto seen = std::count(in_picture.begin(), in_picture.end(), true);
  const auto through = std::count(empty.begin(), empty.end(), true);
  return seen > 0 ? static_cast<double>(through) / static_cast<double>(seen) : 0.0;
}

void ViewMemory::set_clock_back(StampNs latest_ns) {
  for (auto& [key, kept] : views_) {
    for (View& view : kept) view.stamp_ns = std::min(view.stamp_ns, latest_ns);
    if (notes_changes_) changed_.insert(key);
  }
}

std::set<std::uint64_t> ViewMemory::take_changed() {
  std::set<std::uint64_t> keys = std::move(changed_);
  changed_.clear();
  if (!std::exchange(notes_changes_, true)) {
    for (const auto& entry : views_) keys.insert(entry.first);
  }
  return keys;
}

std::size_t ViewMemory::size() const {
  std::size_t count = 0;
  for (const auto& [key, kept] : views_) count += kept.size();
  return count;
}

}  // namespace pocd
