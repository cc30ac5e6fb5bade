#include "pocd/eval/ray_traced_change.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

// A wall at depth `z` filling about 1 x 1 m, sampled like a depth image with a pixel of 1 cm at 1
// m; `slope` turns it about the vertical axis, `noise` is along the ray.
Points wall(double z, double slope, double noise, Random& random) {
  Points points;
  for (double u = -0.4; u < 0.4; u += 0.01) {
    for (double v = -0.4; v < 0.4; v += 0.01) {
      const Eigen::Vector3d ray(u + 0.005 * random.uniform(), v + 0.005 * random.uniform(), 1.0);
      const double depth = z / (1.0 - slope * ray.x());
      points.push_back((ray * depth + noise * random.normal() * ray.normalized()).cast<float>());
    }
  }
  return points;
}

TEST(RayTracedChange, SameCloudHasNone) {
  Random random(41);
  const Points cloud = wall(1.5, 0.5, 0.01, random);
  const auto change = ray_traced_change(cloud, cloud, 0.0, {});
  ASSERT_TRUE(change);
  EXPECT_EQ(change->delta_m, 0.0);
  EXPECT_GT(change->voxels, 1000u);
}

// Another sampling of the same noisy wall. Rays miss a voxel's centre by up to half a voxel (5 cm),
// so on a slope of s the distances scatter by about 0.3 * 5 cm * s per ray; with about four rays in
// a voxel, two clouds and lambda 1.6 that is at most 1.5 cm at s = 0.5, where tau / 2 is 10 cm.
TEST(RayTracedChange, UnmovedWallHasAlmostNone) {
  Random random(42);
  for (double slope : {0.0, 0.5}) {
    const auto change = ray_traced_change(wall(1.5, slope, 0.005, random),
                                          wall(1.5, slope, 0.005, random), 0.0, {});
    ASSERT_TRUE(change);
    EXPECT_LT(std::abs(change->delta_m), slope == 0.0 ? 0.008 : 0.015);
    EXPECT_LT(std::abs(change->mean_signed_m), 0.002);
  }
}

// A wall moved by d along the viewing direction: every voxel that both bands hold differs by the
// difference of the ranges, d to d * 1.15 at the corner of the image (1.05 on average).
TEST(RayTracedChange, ShiftAlongTheRayIsMeasured) {
  Random random(43);
  const RayTracedChangeOptions options{0.05, 0.2, 1.6};
  for (double d : {0.05, 0.1, 0.2, 0.3}) {
    const Points here = wall(1.6, 0.0, 0.0, random);
    const Points nearer = wall(1.6 - d, 0.0, 0.0, random);
    const auto change = ray_traced_change(here, nearer, -d, options);
    ASSERT_TRUE(change);
    SCOPED_TRACE(d);
    EXPECT_GT(change->delta_m, options.lambda_diff * d * 0.99);
    EXPECT_LT(change->delta_m, options.lambda_diff * d * 1.12);
    EXPECT_NEAR(change->mean_signed_m, change->delta_m / options.lambda_diff, 1e-9);
  }
}

TEST(RayTracedChange, SwappingTheCloudsChangesTheSignOnly) {
  Random random(44);
  for (int i = 0; i < 10; ++i) {
    const double slope = random.uniform(-0.6, 0.6);
    const Points a = wall(1.2, slope, 0.01, random);
    const Points b = wall(1.2 + random.uniform(-0.15, 0.15), slope, 0.01, random);
    const auto forth = ray_traced_change(a, b, -0.1, {});
    const auto back = ray_traced_change(b, a, 0.1, {});
    ASSERT_TRUE(forth && back);
    EXPECT_EQ(forth->voxels, back->voxels);
    // The sums run over the same voxels in another order.
    EXPECT_NEAR(forth->delta_m, -back->delta_m, 1e-12);
    EXPECT_NEAR(forth->mean_signed_m, -back->mean_signed_m, 1e-12);
  }
}

TEST(RayTracedChange, GrowsWithNoise) {
  double last = 0.0;
  for (double noise : {0.0, 0.01, 0.02, 0.04, 0.08}) {
    double sum = 0.0;
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      Random random(50 + seed);
      const Points a = wall(1.5, 0.0, noise, random), b = wall(1.5, 0.0, noise, random);
      const auto change = ray_traced_change(a, b, -1.0, {});
      ASSERT_TRUE(change);
      sum += change->delta_m;
    }
    EXPECT_GT(sum, last) << noise;
    last = sum;
  }
}

TEST(RayTracedChange, NothingInCommonIsNoMeasurement) {
  Random random(45);
  const Points here = wall(1.0, 0.0, 0.0, random);
  EXPECT_FALSE(ray_traced_change(here, wall(3.0, 0.0, 0.0, random), 2.0, {}));
  EXPECT_FALSE(ray_traced_change(here, {}, 0.0, {}));
  EXPECT_FALSE(ray_traced_change({}, here, 0.0, {}));
}

// A single ray along an axis, by hand: surface at 1.025 m, voxels of 5 cm have centres at
// 0.025 + 0.05 i in depth. Bands of 10 cm around 1.025 and 1.075 share the centres 0.975 to 1.125,
// all of which differ by 5 cm.
TEST(RayTracedChange, OneRayByHand) {
  const RayTracedChangeOptions options{0.05, 0.1 + 1e-6, 2.0};
  const auto change = ray_traced_change({{0, 0, 1.025f}}, {{0, 0, 1.075f}}, 0.05, options);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->voxels, 4u);
  EXPECT_NEAR(change->delta_m, -0.1, 1e-6);  // float input
  EXPECT_NEAR(change->mean_signed_m, -0.05, 1e-6);
}

TEST(RayTracedChange, RefusesBadInput) {
  const Points one = {{0, 0, 1}}, bad = {{0, NAN, 1}};
  EXPECT_THROW(ray_traced_change(bad, one, 0.0, {}), std::logic_error);
  EXPECT_THROW(ray_traced_change(one, one, 0.0, {0.05, 0.01, 1.6}), std::logic_error);
  EXPECT_THROW(ray_traced_change(one, one, 0.0, {0.0, 0.2, 1.6}), std::logic_error);
  EXPECT_TRUE(ray_traced_change({{0, 0, 1}, {0, 0, 0}}, one, 0.0, {}));
}

}  // namespace
}  // namespace pocd
