#include "pocd/change/geometric_change.hpp"

#include <gtest/gtest.h>

#include "pocd/change/ray_traced_change.hpp"
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

/// One measure with synthetic differences: only the match and these matter.
double projective(const Sighting& sighting, const Match& match, const ChangeConfig& config = {}) {
  const LibraryObject object(ObjectId{1}, 0.05);
  return geometric_change(object, {}, sighting, match, {}, config);
}

TEST(ProjectiveChange, IsMinusTheMedianDifference) {
  EXPECT_NEAR(projective(with_differences({0.03f, -0.01f, 0.02f}), {}), -0.02, 1e-7)
      << "farther: negative";
  EXPECT_NEAR(projective(with_differences({-0.05f, -0.05f, 0.9f}), {}), 0.05, 1e-7)
      << "nearer: positive";
  EXPECT_EQ(projective(with_differences({}), {}), 0.0);
}

TEST(ProjectiveChange, UnderHalfOfThePointsMoveNothing) {
  // 49 of 100 points seen through by a metre: a hole, a border, a thing taken off its top.
  std::vector<float> differences(51, 0.004f);
  differences.insert(differences.end(), 49, 1.0f);
  EXPECT_NEAR(projective(with_differences(differences), {}), -0.004, 1e-7);
}

TEST(ProjectiveChange, ElsewhereItIsTheDisplacementWithItsSign) {
  Match match;
  match.stationary = false;
  match.displacement_m = 0.4;
  match.sign = -1;
  EXPECT_EQ(projective(with_differences({0.0f, 0.0f, 0.0f}), match), -0.4);
  match.sign = 1;
  EXPECT_EQ(projective(with_differences({}), match), 0.4);
}

TEST(ProjectiveChange, StaysWithinTheBound) {
  ChangeConfig config;
  config.delta_max_m = 0.1;
  EXPECT_EQ(projective(with_differences({0.15f}), {}, config), -0.1);
  EXPECT_EQ(projective(with_differences({3.0f, 0.05f}), {}, config), -0.05f)
      << "points that are seen through altogether do not tell how far it moved";
  config.delta_max_m = 0.5;
  Match match;
  match.stationary = false;
  match.displacement_m = 2.0;
  EXPECT_EQ(projective({}, match, config), 0.5);
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
  pair.object.model.fuse(then.observations.list.at(0).points);
  pair.now = test::segment(shoot(room_with({after}), T_W_C), config);
  DepthField field;
  field.update(pair.now.cloud);
  sight_object(pair.object.model, kBoxClass, 1, pair.now.cloud, field, pair.now.observations,
               {0.1, 0.03, 4.0}, config.depth_noise, pair.sighting);
  return pair;
}

double measured(const Pair& pair, const Match& match, const ChangeConfig& config) {
  return geometric_change(pair.object, pair.now.observations.list.at(0), pair.sighting, match,
                          pair.now.cloud, config);
}

TEST(GeometricChange, SmallStepsOfARealBox) {
  // Two centimetres along the view. Of the 3 x 3 pixels around a point the one nearest to the
  // expected depth is taken; on a face that slopes by 0.3 this hides up to 5 mm, and the top does
  // not move at all, so that the median lies near the lower end of the front's: 9 mm.
  const ChangeConfig config;
  EXPECT_NEAR(measured(object_and_observation(solid(kBoxClass, {0, 2.3}, kSize),
                                              solid(kBoxClass, {0, 2.28}, kSize)),
                       {}, config),
              0.02, 0.009);
  EXPECT_NEAR(measured(object_and_observation(solid(kBoxClass, {0, 2.3}, kSize),
                                              solid(kBoxClass, {0, 2.32}, kSize)),
                       {}, config),
              -0.02, 0.009);
  EXPECT_NEAR(measured(object_and_observation(solid(kBoxClass, {0, 2.3}, kSize),
                                              solid(kBoxClass, {0, 2.3}, kSize)),
                       {}, config),
              0.0, 0.002);
}

TEST(GeometricChange, RayTracedIsThePublishedMeasureOfTheSameClouds) {
  ChangeConfig config;
  config.measure = ChangeMeasure::kRayTraced;
  const Pair pair =
      object_and_observation(solid(kBoxClass, {0, 2.3}, kSize), solid(kBoxClass, {0, 2.2}, kSize));
  Match match;
  match.stationary = false;
  match.displacement_m = 0.1;
  match.sign = 1;
  const double delta = measured(pair, match, config);
  Points object_C, observation_C;
  const Pose T_C_W = pair.now.cloud.T_W_C.inverse();
  for (const Surfel& s : pair.object.model.surfels()) {
    object_C.push_back((T_C_W * s.point_W.cast<double>()).cast<float>());
  }
  for (const SurfacePoint& p : pair.now.observations.list[0].points) {
    observation_C.push_back((T_C_W * p.point_W.cast<double>()).cast<float>());
  }
  const auto expected = ray_traced_change(object_C, observation_C, -1.0,
                                          {0.05, config.tsdf_truncation_m, config.lambda_diff});
  ASSERT_TRUE(expected);
  // Single and double precision transforms may put a sample into another voxel: a few of thousands.
  EXPECT_NEAR(delta, expected->delta_m, 0.002);
  EXPECT_GT(delta, 0.05);
  match.sign = -1;
  EXPECT_NEAR(measured(pair, match, config), -delta, 1e-9);
}

TEST(GeometricChange, RayTracedWithoutACommonVoxelIsTheDisplacement) {
  ChangeConfig config;
  config.measure = ChangeMeasure::kRayTraced;
  config.tsdf_truncation_m = 0.1;
  const Pair pair = object_and_observation(solid(kBoxClass, {-0.8, 2.3}, kSize),
                                           solid(kBoxClass, {0.8, 2.3}, kSize));
  Match match;
  match.stationary = false;
  match.displacement_m = 1.6;
  match.sign = -1;
  EXPECT_EQ(measured(pair, match, config), -1.6);
}

}  // namespace
}  // namespace pocd
