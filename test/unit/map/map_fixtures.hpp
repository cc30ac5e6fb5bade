// Analytic scenes seen by a camera, and map settings, for the tests of the map.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "look_from.hpp"
#include "pocd/common/random.hpp"
#include "pocd/map/tsdf_map.hpp"

namespace pocd::testing {

struct Sphere {
  Eigen::Vector3d center_W;
  double radius_m;
  std::uint32_t owner = 0;
};

/// A wall at y = wall_y_m (map frame) with spheres before it.
struct Scene {
  double wall_y_m = 2.5;
  std::vector<Sphere> spheres;
};

inline CameraModel small_camera() { return {160, 120, 140.0, 140.0, 79.5, 59.5}; }

/// Camera at p looking along +y of the map, turned by yaw and pitched down [rad].
inline Pose camera_pose(const Eigen::Vector3d& p, double yaw_rad, double pitch_rad) {
  return test::look_from(p, yaw_rad, pitch_rad);
}

struct View {
  Frame frame;
  std::vector<std::uint32_t> owners;

  IntegrationInput input() const {
    return {&frame, owners.data(), frame.camera.width, frame.camera.height, 1};
  }
};

/// Exact depth of the nearest surface per pixel, 0 where there is none.
inline View look(const Scene& scene, const Pose& T_W_C,
                 const CameraModel& camera = small_camera()) {
  View view;
  view.frame.camera = camera;
  view.frame.T_W_C = T_W_C;
  view.frame.depth_m = cv::Mat(camera.height, camera.width, CV_32FC1);
  view.owners.assign(static_cast<std::size_t>(camera.width) * camera.height, 0);
  const Eigen::Vector3d o = T_W_C.translation();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      // Per metre of depth, so that the ray's parameter is the depth.
      const Eigen::Vector3d ray = T_W_C.linear() * camera.back_project(u, v, 1.0);
      double z = std::numeric_limits<double>::infinity();
      std::uint32_t owner = 0;
      if (ray.y() > 0.0) z = (scene.wall_y_m - o.y()) / ray.y();
      for (const Sphere& s : scene.spheres) {
        const Eigen::Vector3d d = o - s.center_W;
        const double a = ray.squaredNorm(), b = ray.dot(d);
        const double root = b * b - a * (d.squaredNorm() - s.radius_m * s.radius_m);
        if (root < 0.0) continue;
        const double hit = (-b - std::sqrt(root)) / a;
        if (hit > 0.0 && hit < z) z = hit, owner = s.owner;
      }
      view.frame.depth_m.at<float>(v, u) = std::isfinite(z) ? static_cast<float>(z) : 0.0f;
      view.owners[static_cast<std::size_t>(v) * camera.width + u] = owner;
    }
  }
  return view;
}

/// Poses on an arc before the wall, all looking at (0, 1.5, 1).
inline std::vector<Pose> arc_of_poses(int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(-0.6, 0.6), z = random.uniform(0.8, 1.4);
    poses.push_back(camera_pose({x, 0.0, z}, std::atan2(x, 1.5), std::atan2(z - 1.0, 1.5)));
  }
  return poses;
}

inline TsdfConfig coarse_config() {
  TsdfConfig config;
  config.voxel_size_m = 0.05;
  config.max_depth_m = 4.0;
  return config;
}

/// Equal keys, distances, weights and owners.
inline bool same_map(const TsdfMap& a, const TsdfMap& b) {
  const std::vector<BlockKey> keys = a.sorted_keys();
  if (keys != b.sorted_keys()) return false;
  for (const BlockKey& key : keys) {
    const VoxelBlock &x = *a.find(key), &y = *b.find(key);
    if (x.tsdf != y.tsdf || x.weight != y.weight || x.owner != y.owner) return false;
  }
  return true;
}

inline Eigen::Vector3d voxel_center(const BlockKey& key, int v, double voxel_m) {
  return Eigen::Vector3d(8.0 * key.x + (v & 7) + 0.5, 8.0 * key.y + (v >> 3 & 7) + 0.5,
                         8.0 * key.z + (v >> 6) + 0.5) *
         voxel_m;
}

}  // namespace pocd::testing
