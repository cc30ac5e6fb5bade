#include "pocd/segmentation/planes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kPersonClass;
using test::kWallClass;

struct Planes {
  OrganizedCloud cloud;
  PlaneSegmentation planes;
};

Planes planes_of(const Frame& frame, const PipelineConfig& config) {
  Planes out;
  ThreadPool pool(1);
  organize(frame, config.segmentation.stride, config.map.max_depth_m, config.classes,
           ClassTable(config.classes), pool, out.cloud);
  segment_planes(out.cloud, config.segmentation, config.depth_noise, out.planes);
  return out;
}

/// Plane of the largest number of pixels that has about this normal.
const Plane* largest_with_normal(const PlaneSegmentation& planes, const Eigen::Vector3f& normal_W) {
  const Plane* best = nullptr;
  for (const Plane& p : planes.planes) {
    if (p.normal_W.dot(normal_W) > 0.98f && (!best || p.pixels > best->pixels)) best = &p;
  }
  return best;
}

TEST(SegmentPlanes, FindsFloorAndWallUnderNoise) {
  const PipelineConfig config = test::room_config();
  Frame frame = test::shoot(test::room_with({}), test::look_from({0.4, 0.2, 1.1}, 0.2, 0.35));
  test::add_noise(frame, config.depth_noise, 1);
  const Planes result = planes_of(frame, config);
  const Plane* floor = largest_with_normal(result.planes, Eigen::Vector3f::UnitZ());
  const Plane* wall = largest_with_normal(result.planes, -Eigen::Vector3f::UnitY());
  ASSERT_TRUE(floor && wall);
  // Noise of 4 cm at 3.5 m, averaged over thousands of pixels, leaves below a millimetre; a
  // centimetre and a degree are what later stages need.
  EXPECT_NEAR(floor->offset_m, 0.0f, 0.01f);
  EXPECT_NEAR(wall->offset_m, -3.5f, 0.01f);
  EXPECT_GT(floor->normal_W.z(), std::cos(M_PI / 180));
  EXPECT_GT(-wall->normal_W.y(), std::cos(M_PI / 180));
  std::size_t returns = 0;
  for (const PixelKind kind : result.cloud.kind) returns += kind != PixelKind::kNone;
  EXPECT_GT(floor->pixels + wall->pixels, 0.95 * static_cast<double>(returns));
}

TEST(SegmentPlanes, NormalsPointAtTheCamera) {
  const PipelineConfig config = test::room_config();
  const Frame frame =
      test::shoot(test::room_with({test::solid(kBoxClass, {0.3, 2.2}, {0.8, 0.8, 0.8}, 0.6)}),
                  test::look_from({0, 0, 1.3}, 0.0, 0.4));
  const Planes result = planes_of(frame, config);
  ASSERT_GE(result.planes.planes.size(), 4u);
  const Eigen::Vector3f eye_W = frame.T_W_C.translation().cast<float>();
  for (const Plane& p : result.planes.planes) {
    EXPECT_NEAR(p.normal_W.norm(), 1.0f, 1e-5f);
    EXPECT_GT(p.normal_W.dot(eye_W) - p.offset_m, 0.0f);
  }
}

TEST(SegmentPlanes, SidesOfABoxAreDifferentPlanes) {
  const PipelineConfig config = test::room_config();
  const double yaw = 0.6;
  const Frame frame =
      test::shoot(test::room_with({test::solid(kBoxClass, {0, 2.0}, {0.8, 0.8, 0.8}, yaw)}),
                  test::look_from({0, 0, 1.3}, 0.0, 0.4));
  const Planes result = planes_of(frame, config);
  const Eigen::Vector3f left(static_cast<float>(-std::cos(yaw)), static_cast<float>(-std::sin(yaw)),
                             0);
  const Eigen::Vector3f right(static_cast<float>(std::sin(yaw)), static_cast<float>(-std::cos(yaw)),
                              0);
  EXPECT_NE(largest_with_normal(result.planes, left), nullptr);
  EXPECT_NE(largest_with_normal(result.planes, right), nullptr);
}

TEST(SegmentPlanes, SmallStepsMakeTwoPlanes) {
  // Two boxes side by side, one of them 15 cm farther: more than tolerance and noise together.
  const PipelineConfig config = test::room_config();
  const Frame frame =
      test::shoot(test::room_with({test::solid(kBoxClass, {-0.5, 2.0}, {1, 0.4, 1}),
                                   test::solid(kBoxClass, {0.5, 2.15}, {1, 0.4, 1})}),
                  test::look_from({0, 0, 0.6}, 0.0, 0.0));
  const Planes result = planes_of(frame, config);
  const auto plane_at = [&](double x, double y) {
    return result.planes.plane_of[test::pixel_of(result.cloud, {x, y, 0.6})];
  };
  EXPECT_NE(plane_at(-0.5, 1.8), PlaneSegmentation::kNoPlane);
  EXPECT_NE(plane_at(0.5, 1.95), PlaneSegmentation::kNoPlane);
  EXPECT_NE(plane_at(-0.5, 1.8), plane_at(0.5, 1.95));
}

/// A box front of 1 m x 1 m that fills most of the view, with a disc of another class on it.
Frame front_with_blob(ClassId blob_class, int radius_px) {
  Frame frame = test::shoot(test::room_with({test::solid(kBoxClass, {0, 1.8}, {1, 0.4, 1})}),
                            test::look_from({0, 0, 0.5}, 0.0, 0.0));
  for (int v = 0; v < frame.labels.rows; ++v) {
    for (int u = 0; u < frame.labels.cols; ++u) {
      const bool inside = std::hypot(u - 160, v - 120) < radius_px;
      if (inside) frame.labels.at<std::uint16_t>(v, u) = blob_class;
    }
  }
  return frame;
}

TEST(VotePlanes, WrongBlobIsOutvoted) {
  const PipelineConfig config = test::room_config();
  Planes result = planes_of(front_with_blob(kWallClass, 25), config);
  const std::size_t middle = test::pixel_of(result.cloud, {0, 1.6, 0.5});
  ASSERT_EQ(result.cloud.label[middle], kWallClass);
  vote_planes(result.planes, config.segmentation.majority_share, result.cloud);
  EXPECT_EQ(result.cloud.label[middle], kBoxClass);
  EXPECT_EQ(result.cloud.kind[middle], PixelKind::kObject) << "the kind follows the class";
}

TEST(VotePlanes, WithoutMajorityNothingChanges) {
  const PipelineConfig config = test::room_config();
  // 70 of the front's half width of 81 pixels: 59 % of the front is blob.
  Planes result = planes_of(front_with_blob(kWallClass, 70), config);
  const std::vector<ClassId> before = result.cloud.label;
  const std::size_t middle = test::pixel_of(result.cloud, {0, 1.6, 0.5});
  const std::size_t corner = test::pixel_of(result.cloud, {0.45, 1.6, 0.9});
  vote_planes(result.planes, config.segmentation.majority_share, result.cloud);
  EXPECT_EQ(result.cloud.label[middle], kWallClass);
  EXPECT_EQ(result.cloud.label[corner], kBoxClass);
}

TEST(VotePlanes, DynamicPixelsNeitherVoteNorChange) {
  const PipelineConfig config = test::room_config();
  Planes result = planes_of(front_with_blob(kPersonClass, 25), config);
  const std::size_t middle = test::pixel_of(result.cloud, {0, 1.6, 0.5});
  vote_planes(result.planes, config.segmentation.majority_share, result.cloud);
  EXPECT_EQ(result.cloud.label[middle], kPersonClass);
  EXPECT_EQ(result.cloud.kind[middle], PixelKind::kDynamic);
  // A person over most of the front does not make the rest of it a person.
  Planes most = planes_of(front_with_blob(kPersonClass, 78), config);
  const std::size_t corner = test::pixel_of(most.cloud, {0.45, 1.6, 0.9});
  vote_planes(most.planes, config.segmentation.majority_share, most.cloud);
  EXPECT_EQ(most.cloud.label[corner], kBoxClass);
}

}  // namespace
}  // namespace pocd
