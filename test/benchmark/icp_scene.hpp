// The alignment that is measured: a box of 1 x 0.5 x 1.2 m, 5 mm noise, seen again 10 cm and 5
// degrees away.
#pragma once

#include <cmath>

#include "pocd/registration/point_to_plane_icp.hpp"
#include "test_clouds.hpp"

namespace pocd::bench {

constexpr double kInlier_m = 0.05;
constexpr double kReach_m = 0.4;

struct IcpScene {
  test::Cloud object;
  Points observed;
  Points observed_normals;
  Pose truth;

  explicit IcpScene(int count, std::uint64_t seed = 1) {
    Random random(seed);
    const Eigen::Vector3d size(1.0, 0.5, 1.2);
    object = test::box_cloud(random, count, {0, 0, 0}, size, 0.005);
    const test::Cloud fresh = test::box_cloud(random, count, {0, 0, 0}, size, 0.005);
    truth = test::motion_about(0.5 * size, {0.08, -0.06, 0.0}, Eigen::Vector3d::UnitZ(), 0.087);
    observed = test::transformed(truth.inverse(), fresh.points);
    for (const auto& n : fresh.normals) {
      observed_normals.push_back((truth.linear().transpose() * n.cast<double>()).cast<float>());
    }
  }

  /// Root mean square distance of the observed points from where they belong.
  double error_mm(const Pose& T) const {
    double sum = 0.0;
    for (const auto& p : observed) {
      sum += (T * p.cast<double>() - truth * p.cast<double>()).squaredNorm();
    }
    return 1e3 * std::sqrt(sum / static_cast<double>(observed.size()));
  }
};

}  // namespace pocd::bench
