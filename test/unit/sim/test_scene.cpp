#include "pocd/sim/scene.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

SceneObject box_object(const Eigen::Vector3d& base_m, double yaw_rad,
                       const Eigen::Vector3d& size_m) {
  SceneObject object;
  object.T_W_O = upright_pose(base_m, yaw_rad);
  ScenePart part;
  part.size_m = size_m;
  part.T_O_P = upright_pose({0, 0, 0.5 * size_m.z()}, 0.0);
  object.parts.push_back(part);
  return object;
}

TEST(Scene, BoundingBoxOfUprightBoxIsTheBox) {
  const OrientedBox box = bounding_box(box_object({1, -2, 0.5}, 0.7, {1.5, 0.5, 2}));
  // 1e-12: rounding of a few multiplications of numbers near 1.
  EXPECT_NEAR(box.pose.yaw_rad, 0.7, 1e-12);
  EXPECT_NEAR((box.pose.position_W - Eigen::Vector3d(1, -2, 1.5)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((box.size_m - Eigen::Vector3d(1.5, 0.5, 2)).norm(), 0.0, 1e-12);
}

TEST(Scene, BoundingBoxOfLeaningCylinderTouchesItsSurface) {
  SceneObject object;
  ScenePart part;
  part.shape = Shape::kCylinder;
  part.size_m = {0.4, 0.4, 1.0};
  part.T_O_P = Pose(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  object.parts.push_back(part);
  const OrientedBox box = bounding_box(object);
  // The top and bottom circles sampled every 0.06 degrees reach the box to within 1e-6 m.
  Eigen::Vector3d reach = Eigen::Vector3d::Zero();
  for (int i = 0; i < 6000; ++i) {
    const double a = 2.0 * M_PI * i / 6000;
    const Eigen::Vector3d p =
        part.T_O_P * Eigen::Vector3d(0.2 * std::cos(a), 0.2 * std::sin(a), 0.5);
    reach = reach.cwiseMax(p.cwiseAbs());
  }
  EXPECT_NEAR((0.5 * box.size_m - reach).cwiseAbs().maxCoeff(), 0.0, 1e-6);
}

TEST(Scene, PoseFollowsTrackAndRestsAtItsEnds) {
  SceneObject object = box_object({9, 9, 0.7}, 0.0, {1, 1, 1});
  object.track = {{2.0, {0, 0}, 0.0}, {4.0, {2, 0}, 1.0}};
  EXPECT_EQ(pose_at(object, 0.0).translation(), Eigen::Vector3d(0, 0, 0.7));
  EXPECT_EQ(pose_at(object, 3.0).translation(), Eigen::Vector3d(1, 0, 0.7));
  EXPECT_EQ(pose_at(object, 99.0).translation(), Eigen::Vector3d(2, 0, 0.7));
  EXPECT_TRUE(exists_at(object, 99.0));
  object.transient = true;
  EXPECT_FALSE(exists_at(object, 1.9));
  EXPECT_TRUE(exists_at(object, 3.0));
  EXPECT_FALSE(exists_at(object, 4.1));
}

/// Slow and obvious: do any of many points of a lie in b?
bool overlap_by_points(const OrientedBox& a, const OrientedBox& b) {
  const Pose T_W_A = upright_pose(a.pose.position_W, a.pose.yaw_rad);
  const Pose T_B_W = upright_pose(b.pose.position_W, b.pose.yaw_rad).inverse();
  constexpr int kSteps = 24;
  for (int x = 0; x <= kSteps; ++x) {
    for (int y = 0; y <= kSteps; ++y) {
      for (int z = 0; z <= kSteps; ++z) {
        const Eigen::Vector3d unit =
            Eigen::Vector3d(x, y, z) / kSteps - Eigen::Vector3d::Constant(0.5);
        const Eigen::Vector3d p = T_B_W * (T_W_A * a.size_m.cwiseProduct(unit));
        if ((p.cwiseAbs().array() < 0.5 * b.size_m.array()).all()) return true;
      }
    }
  }
  return false;
}

TEST(Scene, OverlapAgreesWithPointSampling) {
  Random random(5);
  int overlapping = 0, thin = 0;
  for (int i = 0; i < 300; ++i) {
    const auto draw = [&] {
      OrientedBox box;
      box.pose.position_W = {random.uniform(-1, 1), random.uniform(-1, 1),
                             random.uniform(-0.5, 0.5)};
      box.pose.yaw_rad = random.uniform(-3, 3);
      box.size_m = {random.uniform(0.3, 1.2), random.uniform(0.3, 1.2), random.uniform(0.3, 1.2)};
      return box;
    };
    const OrientedBox a = draw(), b = draw();
    const bool sampled = overlap_by_points(a, b) || overlap_by_points(b, a);
    // Sampling at 5 cm can miss corners that cut in less; it never finds what is not there.
    if (sampled) {
      EXPECT_TRUE(boxes_overlap(a, b)) << i;
      ++overlapping;
    } else if (boxes_overlap(a, b)) {
      EXPECT_FALSE(boxes_overlap(a, b, 0.15)) << i;
      ++thin;
    }
  }
  EXPECT_GT(overlapping, 30);
  EXPECT_LT(thin, 20);
}

}  // namespace
}  // namespace pocd
