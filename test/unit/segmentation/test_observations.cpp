#include "pocd/segmentation/observations.hpp"

#include <gtest/gtest.h>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::kPersonClass;
using test::room_with;
using test::segment;
using test::Segmented;
using test::shoot;
using test::solid;

Pose viewpoint() { return test::look_from({0, 0, 1.1}); }

std::int32_t observation_at(const Segmented& s, const Eigen::Vector3d& point_W) {
  return s.observations.observation_of[test::pixel_of(s.cloud, point_W)];
}

TEST(Observations, EmptyRoomHasNone) {
  EXPECT_TRUE(
      segment(shoot(room_with({}), viewpoint()), test::room_config()).observations.list.empty());
}

TEST(Observations, TwoBoxesAreTwo) {
  const Segmented s = segment(shoot(room_with({solid(kBoxClass, {-0.6, 2.2}, {0.5, 0.4, 0.6}),
                                               solid(kBoxClass, {0.6, 2.5}, {0.4, 0.4, 0.8})}),
                                    viewpoint()),
                              test::room_config());
  ASSERT_EQ(s.observations.list.size(), 2u);
  const std::int32_t left = observation_at(s, {-0.6, 2.0, 0.4});
  const std::int32_t right = observation_at(s, {0.6, 2.3, 0.4});
  ASSERT_NE(left, Observations::kNone);
  ASSERT_NE(right, Observations::kNone);
  EXPECT_NE(left, right);
  const Observation& observation = s.observations.list[left];
  EXPECT_EQ(observation.class_id, kBoxClass);
  // Front and top are seen; the back is known as far as the top reaches it. A grid pixel at 2.2 m
  // is 17 mm, seen from both sides: 4 cm. The foot is within the ground band of 6 cm plus one
  // sigma.
  EXPECT_NEAR(observation.box.pose.position_W.x(), -0.6, 0.04);
  EXPECT_NEAR(observation.box.pose.position_W.y(), 2.2, 0.04);
  EXPECT_NEAR(observation.box.size_m.x(), 0.5, 0.05);
  EXPECT_NEAR(observation.box.size_m.y(), 0.4, 0.05);
  EXPECT_NEAR(observation.box.pose.position_W.z() + observation.box.size_m.z() / 2, 0.6, 0.03);
}

TEST(Observations, TouchingBoxesOfTwoClassesAreTwo) {
  const Segmented s =
      segment(shoot(room_with({solid(kBoxClass, {-0.25, 2.2}, {0.5, 0.4, 0.6}),
                               solid(kCageClass, {0.25, 2.2}, {0.5, 0.4, 0.6}, 0.15)}),
                    viewpoint()),
              test::room_config());
  ASSERT_EQ(s.observations.list.size(), 2u);
  EXPECT_NE(s.observations.list[0].class_id, s.observations.list[1].class_id);
}

TEST(Observations, InstancesOfOneClassStayApart) {
  PipelineConfig config = test::room_config();
  config.classes.label_divisor = 100;
  Frame frame = shoot(room_with({solid(kBoxClass, {-0.25, 2.2}, {0.5, 0.4, 0.6}),
                                 solid(kBoxClass, {0.25, 2.2}, {0.5, 0.4, 0.6}, 0.15)}),
                      viewpoint());
  const int border = 160;  // the boxes meet at x = 0, the middle of the picture
  for (int v = 0; v < frame.labels.rows; ++v) {
    for (int u = 0; u < frame.labels.cols; ++u) {
      auto& label = frame.labels.at<std::uint16_t>(v, u);
      label =
          static_cast<std::uint16_t>(label * 100 + (label == kBoxClass ? 1 + (u >= border) : 0));
    }
  }
  EXPECT_EQ(segment(frame, config).observations.list.size(), 2u);
}

/// A bar of another class before the middle of a long box, upright or leaning; where the box is
/// cut.
Segmented cut_by_a_bar(double lean_rad) {
  SceneObject bar = solid(kCageClass, {0, 1.8}, {0.12, 0.12, 2.6});
  bar.parts[0].T_O_P = Eigen::Translation3d(0, 0, 0.55) *
                       Eigen::AngleAxisd(lean_rad, Eigen::Vector3d::UnitY()) * Pose::Identity();
  const Scene scene = room_with({solid(kBoxClass, {0, 2.6}, {1.6, 0.5, 0.7}), bar});
  return segment(shoot(scene, viewpoint()), test::room_config());
}

int boxes_in(const Segmented& s) {
  int boxes = 0;
  for (const Observation& o : s.observations.list) boxes += o.class_id == kBoxClass;
  return boxes;
}

TEST(Observations, OneCutInTheMiddleIsMergedWhereItsPiecesOverlap) {
  const Segmented s = cut_by_a_bar(0.8);
  const std::int32_t left = observation_at(s, {-0.6, 2.35, 0.5});
  ASSERT_NE(left, Observations::kNone);
  EXPECT_EQ(left, observation_at(s, {0.6, 2.35, 0.5}));
  EXPECT_EQ(boxes_in(s), 1);
  EXPECT_NEAR(s.observations.list[left].box.size_m.x(), 1.6, 0.06);
}

TEST(Observations, PiecesThatDoNotOverlapAreOneWhenTheFaceGoesOnBehindTheBar) {
  const Segmented s = cut_by_a_bar(0.0);
  const std::int32_t left = observation_at(s, {-0.6, 2.35, 0.5});
  ASSERT_NE(left, Observations::kNone);
  EXPECT_EQ(left, observation_at(s, {0.6, 2.35, 0.5}));
  EXPECT_EQ(boxes_in(s), 1);
}

TEST(Observations, PersonAndWallAndFloorAreNone) {
  const Segmented s =
      segment(shoot(room_with({solid(kPersonClass, {0, 2.2}, {0.4, 0.4, 1.6})}), viewpoint()),
              test::room_config());
  EXPECT_TRUE(s.observations.list.empty());
}

TEST(Observations, SmallClustersAreDropped) {
  PipelineConfig config = test::room_config();
  // 12 cm x 12 cm x 20 cm at 2.2 m: front of 12 cm x 14 cm above the band, and a top seen from
  // above.
  const Frame frame =
      shoot(room_with({solid(kBoxClass, {0, 2.2}, {0.12, 0.12, 0.2})}), viewpoint());
  config.segmentation.min_cluster_area_m2 = 0.05;
  EXPECT_TRUE(segment(frame, config).observations.list.empty());
  config.segmentation.min_cluster_area_m2 = 0.005;
  EXPECT_EQ(segment(frame, config).observations.list.size(), 1u);
  config.segmentation.min_cluster_pixels = 2000;
  EXPECT_TRUE(segment(frame, config).observations.list.empty());
}

TEST(Observations, PointsLieOnTheSurfaceWithNormalsTowardsTheCamera) {
  const SceneObject thing = solid(kBoxClass, {0, 2.2}, {0.6, 0.4, 0.6});
  PipelineConfig config = test::room_config();
  config.map.voxel_size_m = 0.05;
  const Segmented s = segment(shoot(room_with({thing}), viewpoint()), config);
  ASSERT_EQ(s.observations.list.size(), 1u);
  const auto& points = s.observations.list[0].points;
  ASSERT_GT(points.size(), 100u);
  EXPECT_LT(points.size(), 400u) << "thinned: 0.6 m x 1 m of surface in cells of 5 cm";
  const Eigen::Vector3f eye_W = s.cloud.T_W_C.translation().cast<float>();
  std::size_t on_surface = 0, with_normal = 0;
  for (const SurfacePoint& p : points) {
    const float front = std::abs(p.point_W.y() - 2.0f), top = std::abs(p.point_W.z() - 0.6f);
    on_surface += std::min(front, top) < 0.01f;
    if (p.normal_W.squaredNorm() < 0.5f) continue;
    ++with_normal;
    EXPECT_GT(p.normal_W.dot(eye_W - p.point_W), 0.0f);
    EXPECT_GT(p.sigma_m, 0.0f);
  }
  // A cell with points of front and top has its mean inside the edge: 12 cells of about 170.
  EXPECT_GT(static_cast<double>(on_surface), 0.85 * static_cast<double>(points.size()));
  EXPECT_GT(static_cast<double>(with_normal), 0.7 * static_cast<double>(points.size()));
}

TEST(Observations, FootInTheGroundBandBelongsToTheThing) {
  const Segmented s =
      segment(shoot(room_with({solid(kBoxClass, {0, 2.2}, {0.6, 0.4, 0.6})}), viewpoint()),
              test::room_config());
  ASSERT_EQ(s.observations.list.size(), 1u);
  EXPECT_EQ(observation_at(s, {0, 2.0, 0.03}), 0) << "its front, 3 cm above the floor";
  EXPECT_EQ(observation_at(s, {0, 1.9, 0.0}), Observations::kNone) << "the floor before it";
}

TEST(BoxOverlap, IsTheSharedPartOfTheSmallerBox) {
  OrientedBox a, b;
  a.size_m = {2, 1, 1};
  b.size_m = {1, 1, 1};
  EXPECT_NEAR(box_overlap(a, b, 0.0), 1.0, 1e-6) << "inside";
  b.pose.position_W.x() = 1.0;
  EXPECT_NEAR(box_overlap(a, b, 0.0), 0.5, 1e-6);
  EXPECT_NEAR(box_overlap(b, a, 0.0), 0.5, 1e-6);
  b.pose.position_W.z() = 0.5;
  EXPECT_NEAR(box_overlap(a, b, 0.0), 0.25, 1e-6);
  b.pose.position_W.z() = 1.5;
  EXPECT_EQ(box_overlap(a, b, 0.0), 0.0) << "one above the other";
  b.pose.position_W = {1.6, 0, 0};
  EXPECT_EQ(box_overlap(a, b, 0.0), 0.0);
}

TEST(BoxOverlap, HeadingCounts) {
  OrientedBox a, b;
  a.size_m = b.size_m = {2.0, 0.2, 1.0};
  b.pose.yaw_rad = M_PI / 2;
  EXPECT_NEAR(box_overlap(a, b, 0.0), 0.1, 1e-5) << "crossed planks share a square";
}

TEST(BoxOverlap, FlatBoxesAreGivenASize) {
  OrientedBox a, b;
  a.size_m = b.size_m = {1, 0, 1};
  EXPECT_NEAR(box_overlap(a, b, 0.1), 1.0, 1e-5);
}

TEST(Observations, AMaskOfStripesHasPoints) {
  const PipelineConfig config = test::room_config();
  const int stride = config.segmentation.stride;
  Frame frame = shoot(room_with({solid(kBoxClass, {0, 1.3}, {1.6, 0.4, 1.6})}), viewpoint());
  // The class in odd columns of the grid only: none of them is on the grid that is looked at near
  // by.
  for (int v = 0; v < frame.labels.rows; ++v) {
    for (int u = 0; u < frame.labels.cols; ++u) {
      if (u / stride % 2 == 0) frame.labels.at<std::uint16_t>(v, u) = kPersonClass;
    }
  }
  const Segmented s = segment(frame, config);
  ASSERT_FALSE(s.observations.list.empty());
  for (const Observation& o : s.observations.list) EXPECT_FALSE(o.points.empty());
}

}  // namespace
}  // namespace pocd
