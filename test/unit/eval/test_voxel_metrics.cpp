#include "pocd/eval/voxel_metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pocd/eval/surface_points.hpp"

namespace pocd {
namespace {

VoxelMetricsConfig plain_config() {
  VoxelMetricsConfig config;
  config.offset_m = 0.0;
  config.min_height_m = 0.0;
  config.min_frames = 1;
  return config;
}

/// `count` points in the voxel of 20 cm with these indices.
void put(Points& points, int x, int y, int z, int count = 3) {
  for (int i = 0; i < count; ++i) {
    points.emplace_back(0.2f * static_cast<float>(x) + 0.1f, 0.2f * static_cast<float>(y) + 0.1f,
                        0.2f * static_cast<float>(z) + 0.06f + 0.02f * static_cast<float>(i));
  }
}

/// A camera at (0, 0, 1) looking along +x; everything at the given depth.
Frame look_along_x(double depth_m) {
  Frame frame;
  frame.camera = {160, 120, 80, 80, 79.5, 59.5};
  frame.T_W_C.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  frame.T_W_C.translation() = Eigen::Vector3d(0, 0, 1);
  frame.depth_m = cv::Mat(120, 160, CV_32FC1, cv::Scalar(depth_m));
  return frame;
}

TEST(VoxelScore, CountsOverlapWithAReferenceAsThePaperDoes) {
  Points map, reference;
  for (int i = 0; i < 6; ++i) put(map, i, 0, 0);         // 0..5
  for (int i = 2; i < 10; ++i) put(reference, i, 0, 0);  // 2..9
  const ObservedRegion nothing(0.05, 3.0, 0.1);
  const VoxelScore score = score_against_reference(map, reference, nothing, plain_config());
  EXPECT_EQ(score.true_positives, 4);
  EXPECT_EQ(score.false_positives, 2);
  EXPECT_EQ(score.false_negatives, 4);
  EXPECT_DOUBLE_EQ(score.precision(), 100.0 * 4 / 6);
  EXPECT_DOUBLE_EQ(score.recall(), 100.0 * 4 / 8);
  EXPECT_DOUBLE_EQ(score.false_positive_rate(), 100.0) << "no voxel is known to be free";
}

TEST(VoxelScore, IsUndefinedWithoutAnythingToCount) {
  const VoxelScore score;
  EXPECT_TRUE(std::isnan(score.precision()));
  EXPECT_TRUE(std::isnan(score.recall()));
  EXPECT_TRUE(std::isnan(score.false_positive_rate()));
}

TEST(OccupiedVoxels, NeedEnoughPointsWithinTheHeights) {
  Points points;
  put(points, 0, 0, 0, 2);
  put(points, 1, 0, 0, 3);
  put(points, -1, -1, 30, 3);
  const auto voxels = occupied_voxels(points, plain_config());
  ASSERT_EQ(voxels.size(), 1u);
  EXPECT_EQ(voxels.begin()->first, (VoxelIndex{1, 0, 0}));
}

TEST(ObservedRegion, SeparatesSeenFromSeenThroughAndUnknown) {
  ObservedRegion region(0.05, 3.0, 0.1);
  region.add(look_along_x(2.0));
  const auto at = [&](double x) {
    return region.at(static_cast<int>(std::floor(x / 0.05)), 0, 20);
  };
  EXPECT_EQ(at(1.0).seen_through, 1);
  EXPECT_EQ(at(1.0).seen, 0);
  EXPECT_EQ(at(2.0).seen, 1);
  EXPECT_EQ(at(2.0).seen_through, 0);
  EXPECT_EQ(at(2.3).seen + at(2.3).seen_through, 0) << "behind the surface";
  EXPECT_EQ(at(-1.0).seen_through, 0) << "behind the camera";
}

TEST(ObservedRegion, EndsAtTheDepthLimitAndSaysNothingWithoutReturn) {
  ObservedRegion region(0.05, 3.0, 0.1);
  region.add(look_along_x(6.0));
  EXPECT_EQ(region.at(58, 0, 20).seen_through, 1);  // 2.9 m
  EXPECT_EQ(region.at(62, 0, 20).seen_through, 0);  // 3.1 m
  ObservedRegion blind(0.05, 3.0, 0.1);
  blind.add(look_along_x(0.0));
  EXPECT_TRUE(blind.blocks().empty());
}

/// A true wall at x = 2 that the camera sees at y, z near the axis.
SurfaceTruth wall_at_two() {
  SurfaceTruth truth;
  truth.distance_m = [](const Eigen::Vector3d& p) { return std::abs(p.x() - 2.0); };
  for (int y = -8; y < 8; ++y) {
    for (int z = 12; z < 28; ++z) truth.visible.push_back({40, y, z});
  }
  return truth;
}

Points wall_points(double x, double y_from, double y_to) {
  Points points;
  for (double y = y_from; y < y_to; y += 0.05) {
    for (double z = 0.625; z < 1.4; z += 0.05) {
      points.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    }
  }
  return points;
}

TEST(TruthScore, IsPerfectForASurfaceWithinTheTolerance) {
  ObservedRegion region(0.05, 3.0, 0.1);
  region.add(look_along_x(2.0));
  // 3 cm off, on the other side of a voxel's border at x = 2.
  const VoxelScore score =
      score_against_truth(wall_points(1.97, -0.375, 0.4), wall_at_two(), region, plain_config());
  EXPECT_DOUBLE_EQ(score.precision(), 100.0);
  EXPECT_DOUBLE_EQ(score.recall(), 100.0);
  EXPECT_DOUBLE_EQ(score.false_positive_rate(), 0.0);
  EXPECT_GT(score.true_negatives, 50);
}

TEST(TruthScore, ChargesAStaleSurfaceInFrontAndAMissingHalf) {
  ObservedRegion region(0.05, 3.0, 0.1);
  region.add(look_along_x(2.0));
  Points map = wall_points(2.01, -0.375, 0.0);  // the half with y < 0
  const Points stale = wall_points(1.3, -0.375, 0.4);
  map.insert(map.end(), stale.begin(), stale.end());
  const VoxelScore score = score_against_truth(map, wall_at_two(), region, plain_config());
  EXPECT_EQ(score.true_positives, 8);    // 2 x 4 voxels of 20 cm
  EXPECT_EQ(score.false_positives, 16);  // 4 x 4
  EXPECT_EQ(score.recalled, 8);
  EXPECT_EQ(score.false_negatives, 8);
  EXPECT_NEAR(score.precision(), 100.0 / 3.0, 1e-9);
}

TEST(TruthScore, JudgesNothingThatTheLastVisitCouldNotSee) {
  ObservedRegion region(0.05, 3.0, 0.1);
  region.add(look_along_x(2.0));
  Points map = wall_points(2.0, -0.375, 0.4);
  const Points hidden = wall_points(2.5, -0.375, 0.4);  // behind the wall
  map.insert(map.end(), hidden.begin(), hidden.end());
  EXPECT_EQ(score_against_truth(map, wall_at_two(), region, plain_config()).false_positives, 0);
}

TEST(SurfacePoints, LieOnAPlaneAndNotAtTheEdgeOfFreeSpace) {
  TsdfConfig config;
  config.voxel_size_m = 0.1;
  TsdfMap map(config);
  VoxelBlock& block = map.touch({0, 0, 0});
  // Signed distance to the plane x = 0.33 over 0.4 m, seen from smaller x.
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    const double x = 0.1 * (i % 8 + 0.5);
    const double s = (0.33 - x) / config.truncation_m();
    block.tsdf[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>(std::lround(32767 * std::min(s, 1.0)));
    block.weight[static_cast<std::size_t>(i)] = s > -0.9 ? 5 : 0;
  }
  const Points points = surface_points(map, 2);
  ASSERT_EQ(points.size(), 64u);
  for (const Eigen::Vector3f& p : points)
    EXPECT_NEAR(p.x(), 0.33, 1e-4);  // quantisation of the tsdf
  EXPECT_TRUE(surface_points(map, 6).empty());
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    if (i % 8 <= 2) block.tsdf[static_cast<std::size_t>(i)] = 32767;
  }
  EXPECT_TRUE(surface_points(map, 2).empty()) << "free beside occupied is where observation ends";
}

}  // namespace
}  // namespace pocd
