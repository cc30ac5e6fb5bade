#include "pocd/registration/point_to_plane_icp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "test_clouds.hpp"

namespace pocd {
namespace {

using test::Cloud;

Eigen::Vector3d random_vector(Random& random, double length) {
  Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
  return length * random.uniform() * v.normalized();
}

// Mean displacement between where two transforms take the points.
double distance(const Pose& a, const Pose& b, const Points& points) {
  double sum = 0.0;
  for (const auto& p : points) sum += (a * p.cast<double>() - b * p.cast<double>()).norm();
  return sum / static_cast<double>(points.size());
}

// The observation is another sampling of the same surface, moved by the inverse of the truth. With
// 2000 noisy points (5 mm) the pose's standard error is about 5 mm / sqrt(2000 / 4) = 0.2 mm; the
// rest of the 4 mm bound is the convergence bound and edges matched across.
TEST(PointToPlaneIcp, RecoversYawMotionOfABox) {
  Random random(11);
  for (int i = 0; i < 25; ++i) {
    const Eigen::Vector3d base(random.uniform(-50, 50), random.uniform(-50, 50), 0.0);
    const Eigen::Vector3d size(1.0, 0.5, 1.5);
    const Cloud object = test::box_cloud(random, 2000, base, size, 0.005);
    const Cloud fresh = test::box_cloud(random, 2000, base, size, 0.005);
    // Beyond about half the smallest extent (0.25 m) a face is nearer to another one than to
    // itself.
    Eigen::Vector3d shift = random_vector(random, 0.25);
    shift.z() *= 0.5;
    const Pose T = test::motion_about(base + 0.5 * size, shift, Eigen::Vector3d::UnitZ(),
                                      random.uniform(-0.2, 0.2));
    const Points observed = test::transformed(T.inverse(), fresh.points);
    const IcpTarget target(object.points, object.normals, 0.05, 0.5);
    const IcpResult result = point_to_plane_icp(target, observed, {});
    SCOPED_TRACE(i);
    EXPECT_TRUE(result.converged);
    EXPECT_TRUE(result.unconstrained.empty());
    EXPECT_LT(distance(result.T_target_source, T, observed), 0.004);
    EXPECT_LT(result.dissimilarity, 0.12);  // sparse spots of a random sampling
    EXPECT_LT(result.rms_residual_m, 0.02);
    // Only yaw may turn: the third row and column stay those of the identity.
    EXPECT_NEAR(result.T_target_source.linear()(2, 2), 1.0, 1e-12);
  }
}

TEST(PointToPlaneIcp, RecoversFullMotionOfACorner) {
  Random random(12);
  IcpOptions options;
  options.freedom = IcpFreedom::kFull;
  for (int i = 0; i < 25; ++i) {
    const Cloud object = test::corner_cloud(random, 3000, 0.003);
    const Cloud fresh = test::corner_cloud(random, 3000, 0.003);
    const Pose T = test::motion_about({0.5, 0.5, 0.5}, random_vector(random, 0.15),
                                      random_vector(random, 1.0), random.uniform(-0.15, 0.15));
    const Points observed = test::transformed(T.inverse(), fresh.points);
    const IcpTarget target(object.points, object.normals, 0.05, 0.4);
    const IcpResult result = point_to_plane_icp(target, observed, options);
    SCOPED_TRACE(i);
    EXPECT_TRUE(result.converged);
    EXPECT_LT(distance(result.T_target_source, T, observed), 0.004);
  }
}

// Two walls leave z open: it must stay, and be named, while x, y and yaw are recovered.
TEST(PointToPlaneIcp, LShapeRecoversAllButHeight) {
  Random random(13);
  for (int i = 0; i < 15; ++i) {
    const Cloud object = test::l_shape_cloud(random, 3000, 0.003);
    const Cloud fresh = test::l_shape_cloud(random, 3000, 0.003);
    const Eigen::Vector3d shift(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0.0);
    const Pose T = test::motion_about({1.0, 0.5, 1.0}, shift, Eigen::Vector3d::UnitZ(),
                                      random.uniform(-0.1, 0.1));
    const Points observed = test::transformed(T.inverse(), fresh.points);
    const IcpTarget target(object.points, object.normals, 0.05, 0.4);
    const IcpResult result = point_to_plane_icp(target, observed, {});
    SCOPED_TRACE(i);
    EXPECT_LT(distance(result.T_target_source, T, observed), 0.004);
    ASSERT_EQ(result.unconstrained.size(), 1u);
    EXPECT_NEAR(std::abs(result.unconstrained[0][2]), 1.0, 1e-6);
  }
}

// A wall seen again, 30 cm along itself and 4 cm in front: only the 4 cm are observable. Normals
// are those of a noisy reconstruction (3 degrees).
TEST(PointToPlaneIcp, FlatWallDoesNotSlide) {
  Random random(14);
  for (IcpFreedom freedom : {IcpFreedom::kYaw, IcpFreedom::kFull}) {
    Cloud wall, seen;
    test::add_patch(wall, random, 3000, {0, 0, 0}, {3, 0, 0}, {0, 0, 2}, 0.003);
    test::add_patch(seen, random, 2000, {0.8, -0.04, 0.3}, {1.5, 0, 0}, {0, 0, 1.5}, 0.003);
    for (auto& n : wall.normals) {
      const Eigen::Vector3f tilt(static_cast<float>(random.normal()),
                                 static_cast<float>(random.normal()),
                                 static_cast<float>(random.normal()));
      n = (n + 0.05f * tilt).normalized();
    }
    const IcpTarget target(wall.points, wall.normals, 0.05, 0.4);
    IcpOptions options;
    options.freedom = freedom;
    const IcpResult result = point_to_plane_icp(target, seen.points, options);
    const Eigen::Vector3d centre(1.55, -0.04, 1.05);
    const Eigen::Vector3d moved = result.T_target_source * centre - centre;
    EXPECT_TRUE(result.converged);
    EXPECT_NEAR(moved.y(), 0.04, 0.002);
    EXPECT_NEAR(moved.x(), 0.0, 0.005);
    EXPECT_NEAR(moved.z(), 0.0, 0.005);
    // x and z; with all six freedoms also the rotation in the wall's plane.
    EXPECT_EQ(result.unconstrained.size(), freedom == IcpFreedom::kYaw ? 2u : 3u);
  }
}

TEST(PointToPlaneIcp, DissimilarityIsTheShareOfOutliers) {
  Random random(15);
  Cloud object;
  for (double x = 0; x < 1; x += 0.02) {
    for (double z = 0; z < 1; z += 0.02) object.add({x, 0, z}, {0, -1, 0});
  }
  for (double y = 0.02; y < 1; y += 0.02) {
    for (double x = 0; x < 1; x += 0.02) object.add({x, y, 0}, {0, 0, 1});
  }
  Points observed(object.points.begin(), object.points.end());
  const std::size_t own = observed.size();
  for (std::size_t i = 0; i < own / 3; ++i) {
    observed.emplace_back(static_cast<float>(random.uniform()),
                          static_cast<float>(random.uniform(-0.9, -0.7)),
                          static_cast<float>(random.uniform()));
  }
  const IcpTarget target(object.points, object.normals, 0.05, 0.3);
  const IcpResult result = point_to_plane_icp(target, observed, {});
  EXPECT_NEAR(result.dissimilarity, 0.25, 1e-3);
}

TEST(PointToPlaneIcp, NothingNearIsNotConverged) {
  Random random(16);
  const Cloud object = test::box_cloud(random, 500, {0, 0, 0}, {1, 1, 1});
  const IcpTarget target(object.points, object.normals, 0.05, 0.3);
  Pose T = Pose::Identity();
  T.translation().x() = 5.0;
  const IcpResult far = point_to_plane_icp(target, object.points, {}, T);
  EXPECT_FALSE(far.converged);
  EXPECT_EQ(far.dissimilarity, 1.0);
  EXPECT_TRUE(far.T_target_source.isApprox(T, 1e-12));
  const IcpResult empty = point_to_plane_icp(target, {}, {});
  EXPECT_FALSE(empty.converged);
  EXPECT_EQ(empty.dissimilarity, 1.0);
}

TEST(PointToPlaneIcp, SameInputSameBits) {
  Random random(17);
  const Cloud object = test::box_cloud(random, 2000, {0, 0, 0}, {1, 0.5, 1}, 0.005);
  const Points observed = test::transformed(
      test::motion_about({0, 0, 0}, {0.1, 0.05, 0}, Eigen::Vector3d::UnitZ(), 0.1), object.points);
  const IcpTarget one(object.points, object.normals, 0.05, 0.4);
  const IcpTarget two(object.points, object.normals, 0.05, 0.4);
  const Pose a = point_to_plane_icp(one, observed, {}).T_target_source;
  const Pose b = point_to_plane_icp(two, observed, {}).T_target_source;
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * 16), 0);
}

// Exact within the inlier distance; beyond it, never nearer than the truth and within the stated
// error: the representative's cell is no larger than the true distance, so at most its diagonal
// away.
TEST(IcpTarget, NearestAgainstBruteForce) {
  Random random(18);
  const Cloud object = test::box_cloud(random, 1500, {20, -30, 1}, {1, 0.5, 1}, 0.01);
  const double inlier = 0.05, limit = 0.4;
  const IcpTarget target(object.points, object.normals, inlier, limit);
  ASSERT_EQ(target.size(), object.points.size());
  int near = 0, middle = 0, none = 0;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3f query(static_cast<float>(random.uniform(-0.6, 1.6)),
                                static_cast<float>(random.uniform(-0.6, 1.1)),
                                static_cast<float>(random.uniform(-0.6, 1.6)));
    const Eigen::Vector3f origin = target.origin_W().cast<float>();
    float truth = 1e9f;
    for (const auto& p : object.points) truth = std::min(truth, (p - origin - query).norm());
    const auto found = target.nearest(query);
    SCOPED_TRACE(truth);
    if (truth <= inlier) {
      ++near;
      ASSERT_TRUE(found);
      EXPECT_NEAR(std::sqrt(found->squared_distance_m2), truth, 1e-5);
      EXPECT_NEAR((found->point - query).norm(), truth, 1e-5);
    } else if (found) {
      ++middle;
      EXPECT_GE(std::sqrt(found->squared_distance_m2), truth - 1e-5);
      EXPECT_LE(std::sqrt(found->squared_distance_m2), truth * (1.0 + std::sqrt(3.0)));
    } else {
      ++none;
      EXPECT_GT(truth * (1.0 + std::sqrt(3.0)), limit);
    }
  }
  EXPECT_GT(near, 100);
  EXPECT_GT(middle, 100);
  EXPECT_GT(none, 20);
}

TEST(IcpTarget, RefusesBadInput) {
  const Points one = {{0, 0, 0}}, normal = {{0, 0, 1}};
  EXPECT_THROW(IcpTarget({}, {}, 0.05, 0.3), std::logic_error);
  EXPECT_THROW(IcpTarget(one, {}, 0.05, 0.3), std::logic_error);
  EXPECT_THROW(IcpTarget(one, normal, 0.0, 0.3), std::logic_error);
  EXPECT_THROW(IcpTarget(one, normal, 0.4, 0.3), std::logic_error);
  EXPECT_THROW(IcpTarget({{NAN, 0, 0}}, normal, 0.05, 0.3), std::logic_error);
}

}  // namespace
}  // namespace pocd
