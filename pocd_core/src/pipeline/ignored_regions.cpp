#include "ignored_regions.hpp"

#include <algorithm>

namespace pocd {
namespace {

struct Bounds {
  explicit Bounds(const Polygon& polygon) : low(polygon.front()), high(polygon.front()) {
    for (const Eigen::Vector2d& corner : polygon) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  bool beside(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
    return (a.cwiseMax(b).array() < low.array()).any() ||
           (a.cwiseMin(b).array() > high.array()).any();
  }
  Eigen::Vector2d low, high;
};

}  // namespace

void IgnoredRegions::mark(double max_depth_m, ThreadPool& pool, OrganizedCloud& cloud) const {
  if (by_name_.empty()) return;
  const Eigen::Vector2d eye = cloud.T_W_C.translation().head<2>();
  const CameraModel& camera = cloud.camera;
  const double half_w = std::max(camera.cx, cloud.width - camera.cx) / camera.fx;
  const double half_h = std::max(camera.cy, cloud.height - camera.cy) / camera.fy;
  const Eigen::Vector2d reach =
      Eigen::Vector2d::Constant(max_depth_m * std::hypot(1.0, std::hypot(half_w, half_h)));
  std::vector<std::pair<const Polygon*, Bounds>> near;
  for (const auto& [name, polygon] : by_name_) {
    const Bounds bounds(polygon);
    if (!bounds.beside(eye - reach, eye + reach)) near.emplace_back(&polygon, bounds);
  }
  if (near.empty()) return;
  pool.parallel_for(cloud.height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      for (int col = 0; col < cloud.width; ++col) {
        const std::size_t i = row * cloud.width + col;
        const double depth_m =
            cloud.depth_m[i] > 0.0f ? std::min<double>(cloud.depth_m[i], max_depth_m) : max_depth_m;
        const Eigen::Vector3d ray_C((col + 0.5 - camera.cx) / camera.fx,
                                    (static_cast<double>(row) + 0.5 - camera.cy) / camera.fy, 1.0);
        const Eigen::Vector2d end_W = (cloud.T_W_C * (depth_m * ray_C)).head<2>();
        for (const auto& [polygon, bounds] : near) {
          if (bounds.beside(eye, end_W) || !passes_through(*polygon, eye, end_W)) continue;
          cloud.kind[i] = PixelKind::kIgnore;
          break;
        }
      }
    }
  });
}

}  // namespace pocd
