#include "pocd/observe/geometric_change.hpp"

#include <gtest/gtest.h>

#include "pocd/segmentation/observations.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::shoot;
using test::solid;

const Eigen::Vector3d kSize(0.6, 0.4, 0.6);

Sighting with_differences(std::vector<float> differences_m) {
  Sighting s;
  s.differences_m = std::move(differences_m);
  return s;
}

TEST(ProjectiveChange, IsMinusTheMedianDifference) {
  EXPECT_NEAR(geometric_change(with_differences({0.03f, -0.01f, 0.02f}), {}), -0.02, 1e-7)
      << "farther: negative";
  EXPECT_NEAR(geometric_change(with_differences({-0.05f, -0.05f, 0.9f}), {}), 0.05, 1e-7)
      << "nearer: positive";
  EXPECT_EQ(geometric_change(with_differences({}), {}), 0.0);
}

TEST(ProjectiveChange, UnderHalfOfThePointsMoveNothing) {
  // 49 of 100 points seen through by a metre: a hole, a border, a thing taken off its top.
  std::vector<float> differences(51, 0.004f);
  differences.insert(differences.end(), 49, 1.0f);
  EXPECT_NEAR(geometric_change(with_differences(differences), {}), -0.004, 1e-7);
}

TEST(ProjectiveChange, StaysWithinTheBound) {
  ChangeConfig config;
  config.delta_max_m = 0.1;
  EXPECT_EQ(geometric_change(with_differences({0.15f}), config), -0.1);
  EXPECT_EQ(geometric_change(with_differences({3.0f, 0.05f}), config), -0.05f)
      << "points that are seen through altogether do not tell how far it moved";
}

TEST(ProjectiveChange, NothingMeasuredInPlaceTellsOfNoChange) {
  // All points seen through: the object is gone, but nothing says that its surface moved.
  EXPECT_EQ(geometric_change(with_differences({1.0f, 1.1f, 0.9f}), {}), 0.0);
}

/// An object made of one frame of a scene, and the only observation of another frame.
struct Pair {
  LibraryObject object{ObjectId{1}, 0.05};
  test::Segmented now;
  Sighting sighting;
};

Pair object_and_observation(const SceneObject& before, const SceneObject& after) {
  const PipelineConfig config = test::room_config();
  const Pose T_W_C = test::look_from({0, 0, 1.1});
  Pair pair;
  const test::Segmented then = test::segment(shoot(room_with({before}), T_W_C), config);
  pair.object.class_id = kBoxClass;
  pair.object.model.fuse(then.observations.list.at(0).points, 1);
  pair.now = test::segment(shoot(room_with({after}), T_W_C), config);
  DepthField field;
  field.update(pair.now.cloud);
  sight_object(pair.object.model.surfels(), 1, pair.now.cloud, field, pair.now.observations,
               {0.1, 0.03, 4.0}, config.depth_noise, pair.sighting);
  return pair;
}

double measured(const SceneObject& before, const SceneObject& after) {
  return geometric_change(object_and_observation(before, after).sighting, {});
}

TEST(GeometricChange, SmallStepsOfARealBox) {
  // Two centimetres along the view. Of the 3 x 3 pixels around a point the one nearest to the
  // expected depth is taken; on a face that slopes by 0.3 this hides up to 5 mm, and the top does
  // not move at all, so that the median lies near the lower end of the front's: 9 mm.
  const auto at = [](double y) { return solid(kBoxClass, {0, y}, kSize); };
  EXPECT_NEAR(measured(at(2.3), at(2.28)), 0.02, 0.009);
  EXPECT_NEAR(measured(at(2.3), at(2.32)), -0.02, 0.009);
  EXPECT_NEAR(measured(at(2.3), at(2.3)), 0.0, 0.002);
}

}  // namespace
}  // namespace pocd
