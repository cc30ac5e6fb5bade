// Sampled surfaces with exact normals, for the tests and benchmarks of alignment.
#pragma once

#include <cmath>
#include <vector>

#include "pocd/common/random.hpp"
#include "pocd/common/types.hpp"

namespace pocd::test {

struct Cloud {
  Points points;
  Points normals;

  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    points.push_back(point.cast<float>());
    normals.push_back(normal.cast<float>());
  }
};

/// `count` uniform points on the parallelogram corner + a u + b v, a, b in [0, 1), with noise along
/// its normal u x v.
inline void add_patch(Cloud& cloud, Random& random, int count, const Eigen::Vector3d& corner,
                      const Eigen::Vector3d& u, const Eigen::Vector3d& v, double noise_m) {
  const Eigen::Vector3d normal = u.cross(v).normalized();
  for (int i = 0; i < count; ++i) {
    const double a = random.uniform(), b = random.uniform();
    cloud.add(corner + a * u + b * v + noise_m * random.normal() * normal, normal);
  }
}

/// The four sides and the top of an upright box standing at `base` (corner of least x, y, z).
inline Cloud box_cloud(Random& random, int count, const Eigen::Vector3d& base,
                       const Eigen::Vector3d& size, double noise_m = 0.0) {
  const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  const double area = 2 * size.z() * (size.x() + size.y()) + size.x() * size.y();
  const auto share = [&](double a) { return static_cast<int>(std::lround(count * a / area)); };
  Cloud cloud;
  add_patch(cloud, random, share(size.x() * size.z()), base, x, z, noise_m);
  add_patch(cloud, random, share(size.x() * size.z()), base + y, z, x, noise_m);
  add_patch(cloud, random, share(size.y() * size.z()), base, z, y, noise_m);
  add_patch(cloud, random, share(size.y() * size.z()), base + x, y, z, noise_m);
  add_patch(cloud, random, share(size.x() * size.y()), base + z, x, y, noise_m);
  return cloud;
}

/// Two walls meeting in a right angle, 2 m and 1 m long and 2 m high: no floor, so z is open.
inline Cloud l_shape_cloud(Random& random, int count, double noise_m = 0.0) {
  Cloud cloud;
  add_patch(cloud, random, 2 * count / 3, {0, 0, 0}, {2, 0, 0}, {0, 0, 2}, noise_m);
  add_patch(cloud, random, count / 3, {0, 0, 0}, {0, 0, 2}, {0, 1, 0}, noise_m);
  return cloud;
}

/// Three walls meeting in a corner.
inline Cloud corner_cloud(Random& random, int count, double noise_m = 0.0) {
  Cloud cloud;
  add_patch(cloud, random, count / 3, {0, 0, 0}, {1, 0, 0}, {0, 0, 1}, noise_m);
  add_patch(cloud, random, count / 3, {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, noise_m);
  add_patch(cloud, random, count / 3, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}, noise_m);
  return cloud;
}

/// Translation and rotation about `centre`, by yaw only or about a random axis.
inline Pose motion_about(const Eigen::Vector3d& centre, const Eigen::Vector3d& translation,
                         const Eigen::Vector3d& axis, double angle_rad) {
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
  T.translation() = centre + translation - T.linear() * centre;
  return T;
}

inline Points transformed(const Pose& T, const Points& points) {
  Points result;
  for (const auto& p : points) result.push_back((T * p.cast<double>()).cast<float>());
  return result;
}

}  // namespace pocd::test
