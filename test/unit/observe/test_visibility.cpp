#include "pocd/observe/visibility.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::kPersonClass;
using test::room_with;
using test::shoot;
using test::solid;

constexpr double kSpacing_m = 0.05;
const Eigen::Vector3d kBoxSize(0.6, 0.4, 0.6);

SceneObject the_box(double x = 0.0) { return solid(kBoxClass, {x, 2.4}, kBoxSize); }
Pose viewpoint() { return test::look_from({0, 0, 0.9}, 0.0, 0.15); }

/// The front of the box at (0, 2.2) as a grid of surfels, facing the camera.
ObjectModel front_of_the_box(int hits = 5) {
  ObjectModel model(kSpacing_m);
  std::vector<SurfacePoint> points;
  for (double x = -0.275; x < 0.3; x += kSpacing_m) {
    for (double z = 0.125; z < 0.6; z += kSpacing_m) {
      points.push_back({{static_cast<float>(x), 2.2f, static_cast<float>(z)}, {0, -1, 0}, 0.01f});
    }
  }
  for (int i = 0; i < hits; ++i) model.fuse(points, i + 1);
  return model;
}

Sighting sight(const ObjectModel& model, const Frame& frame, int min_hits = 2,
               const SightConfig& config = {0.1, 0.03, 4.0}) {
  const PipelineConfig pipeline = test::room_config();
  const test::Segmented s = test::segment(frame, pipeline);
  DepthField field;
  field.update(s.cloud);
  Sighting out;
  sight_object(model.surfels(), min_hits, s.cloud, field, s.observations, config,
               pipeline.depth_noise, out);
  return out;
}

TEST(Visibility, InPlaceIsHitWithoutDifference) {
  const ObjectModel model = front_of_the_box();
  const Sighting s = sight(model, shoot(room_with({the_box()}), viewpoint()));
  EXPECT_EQ(s.total, static_cast<int>(model.surfels().size()));
  EXPECT_EQ(s.hit, s.total);
  EXPECT_EQ(s.seen_through_share(), 0.0);
  EXPECT_EQ(s.visible_share(), 1.0);
  ASSERT_EQ(s.differences_m.size(), static_cast<std::size_t>(s.total));
  // A fronto-parallel face, half a degree of pixels aslant: below 5 mm.
  for (const float d : s.differences_m) EXPECT_NEAR(d, 0.0f, 0.005f);
  ASSERT_EQ(s.touches.size(), 1u);
  EXPECT_EQ(s.touches[0].hit, s.hit);
  EXPECT_EQ(s.touches[0].in_front, 0);
}

TEST(Visibility, RemovedIsSeenThrough) {
  const ObjectModel model = front_of_the_box();
  const Sighting s = sight(model, shoot(room_with({}), viewpoint()));
  EXPECT_EQ(s.hit, 0);
  // Points near the floor may be hit by it: nothing tells the floor 10 cm behind from the point.
  EXPECT_GT(s.seen_through, 0.8 * s.total);
  EXPECT_EQ(s.seen_through_share(), 1.0);
  for (const float d : s.differences_m) EXPECT_GT(d, 0.1f);
}

TEST(Visibility, HiddenIsNotSeenThrough) {
  // A cage right before the empty place, and right before the box: the same sight of the model.
  for (const bool there : {true, false}) {
    std::vector<SceneObject> things{solid(kCageClass, {0, 1.4}, {1.2, 0.3, 1.4})};
    if (there) things.push_back(the_box());
    const Frame frame = shoot(room_with(things), viewpoint());
    // The cage stands 0.95 m before the face.
    for (const double cover_m : {1.5, 0.5}) {
      const Sighting s = sight(front_of_the_box(), frame, 2, {0.1, 0.03, 4.0, cover_m});
      EXPECT_EQ(s.visible(), 0);
      EXPECT_EQ(s.visible_share(), 0.0);
      EXPECT_EQ(s.occluded, s.total);
      if (cover_m < 0.95) {
        EXPECT_TRUE(s.touches.empty()) << "what hides it from afar has not taken its place";
        continue;
      }
      ASSERT_EQ(s.touches.size(), 1u);
      EXPECT_EQ(s.touches[0].in_front, s.total) << "the observation that hides it is named";
    }
  }
}

TEST(Visibility, HolesAreUnknown) {
  Frame frame = shoot(room_with({}), viewpoint());
  frame.depth_m.setTo(0.0f);
  const Sighting s = sight(front_of_the_box(), frame);
  EXPECT_EQ(s.unknown, s.total);
  EXPECT_EQ(s.visible(), 0);
  for (const Sight sight : s.sights) EXPECT_EQ(sight, Sight::kUnknown);
}

TEST(Visibility, DynamicPixelsHideWhereverTheyAre) {
  // A person before the place, at it and behind it: in none of these cases the place is visible
  // (a walking person's depth and mask are not of the same instant).
  for (const double y : {1.5, 2.3, 2.5}) {
    const Frame frame =
        shoot(room_with({solid(kPersonClass, {0, y}, {2.0, 0.2, 1.8})}), viewpoint());
    const Sighting s = sight(front_of_the_box(), frame);
    EXPECT_EQ(s.visible(), 0) << y;
    EXPECT_GT(s.occluded, 0.9 * s.total) << y;
  }
}

TEST(Visibility, OutOfViewIsCountedInTotalAlone) {
  const Frame frame = shoot(room_with({the_box()}), test::look_from({0, 0, 0.9}, M_PI));
  const Sighting s = sight(front_of_the_box(), frame);
  EXPECT_EQ(s.hit + s.seen_through + s.occluded + s.unknown, 0);
  EXPECT_GT(s.total, 0);
  for (const Sight sight : s.sights) EXPECT_EQ(sight, Sight::kOutOfView);
}

TEST(Visibility, BeyondTheDepthLimitIsOutOfView) {
  const Sighting s =
      sight(front_of_the_box(), shoot(room_with({the_box()}), viewpoint()), 2, {0.1, 0.03, 2.0});
  EXPECT_EQ(s.visible(), 0);
}

TEST(Visibility, SurfelsFacingAwayBearWitnessOnlyWhenSeenThrough) {
  ObjectModel model = front_of_the_box();
  for (Surfel& surfel : model.surfels()) surfel.normal_W = -surfel.normal_W;
  // The back of a thing cannot be measured from its front; but what lies behind it can only be seen
  // when the thing is gone.
  const Sighting there = sight(model, shoot(room_with({the_box()}), viewpoint()));
  EXPECT_EQ(there.hit + there.seen_through + there.occluded + there.unknown, 0);
  const Sighting gone = sight(model, shoot(room_with({}), viewpoint()));
  EXPECT_EQ(gone.hit, 0);
  EXPECT_GT(gone.seen_through, 0.8 * gone.total);
}

TEST(Visibility, EdgeWithinThePoseToleranceIsNotSeenThrough) {
  // The box stands where it was, but its surfels are taken to be 6 cm to the side: those at its
  // edge project beside it, on the wall behind. With a tolerance of 8 cm none of them counts as
  // seen through; without it some do.
  const ObjectModel model = front_of_the_box();
  ObjectModel shifted(kSpacing_m);
  std::vector<SurfacePoint> points;
  for (const Surfel& s : model.surfels()) {
    points.push_back({s.point_W + Eigen::Vector3f(0.06f, 0.0f, 0.0f), s.normal_W, 0.01f});
  }
  for (int i = 0; i < 3; ++i) shifted.fuse(points, i + 1);
  const Frame frame = shoot(room_with({the_box()}), viewpoint());
  EXPECT_EQ(sight(shifted, frame, 2, {0.1, 0.08, 4.0}).seen_through, 0);
  EXPECT_GT(sight(shifted, frame, 2, {0.1, 0.0, 4.0}).seen_through, 0);
}

TEST(Visibility, MarginGrowsWithTheNoiseAndThePoseTolerance) {
  // The box farther than the model says. At 2.2 m three sigma of the noise are 5.6 cm, to which the
  // pose tolerance is added; a larger margin counts instead of both.
  const ObjectModel model = front_of_the_box();
  const auto hits = [&](double farther_m, double margin_m, double pose_tolerance_m) {
    const Frame frame =
        shoot(room_with({solid(kBoxClass, {0, 2.4 + farther_m}, kBoxSize)}), viewpoint());
    const Sighting s = sight(model, frame, 2, {margin_m, pose_tolerance_m, 4.0});
    return static_cast<double>(s.hit) / std::max(1, s.visible());
  };
  EXPECT_GT(hits(0.04, 0.0, 0.0), 0.9);
  EXPECT_LT(hits(0.08, 0.0, 0.0), 0.5);
  EXPECT_GT(hits(0.07, 0.0, 0.03), 0.9);
  EXPECT_LT(hits(0.12, 0.0, 0.03), 0.5);
  EXPECT_GT(hits(0.12, 0.15, 0.03), 0.9);
}

TEST(Visibility, OnlyEstablishedSurfelsBearWitness) {
  const ObjectModel once = front_of_the_box(1);
  const Frame frame = shoot(room_with({}), viewpoint());
  EXPECT_EQ(sight(once, frame, 2).total, 0);
  EXPECT_GT(sight(once, frame, 1).seen_through, 0);
  EXPECT_EQ(sight(once, frame, 2).sights.size(), once.surfels().size());
}

TEST(Visibility, NeedsNoReturnWithinTheDepthLimit) {
  // The wall is beyond the limit, but its returns prove that the place before it is empty.
  PipelineConfig pipeline = test::room_config();
  pipeline.map.max_depth_m = 3.0;
  const test::Segmented s = test::segment(shoot(room_with({}), viewpoint()), pipeline);
  DepthField field;
  field.update(s.cloud);
  Sighting out;
  sight_object(front_of_the_box().surfels(), 2, s.cloud, field, s.observations, {0.1, 0.03, 3.0},
               pipeline.depth_noise, out);
  EXPECT_GT(out.seen_through, 0.8 * out.total);
}

TEST(DepthField, NearestAgainstBruteForce) {
  Random random(21);
  OrganizedCloud cloud;
  cloud.width = 50;
  cloud.height = 40;
  for (int i = 0; i < cloud.width * cloud.height; ++i) {
    const bool hole = random.uniform() < 0.6;
    cloud.depth_m.push_back(hole ? 0.0f : static_cast<float>(random.uniform(0.5, 5.0)));
  }
  DepthField field;
  field.update(cloud);
  for (int radius : {1, 2, 4, 8, 16}) {
    for (int i = 0; i < 200; ++i) {
      const int col = static_cast<int>(random.below(50)), row = static_cast<int>(random.below(40));
      float least = std::numeric_limits<float>::infinity();
      for (int v = std::max(0, row - radius); v <= std::min(39, row + radius); ++v) {
        for (int u = std::max(0, col - radius); u <= std::min(49, col + radius); ++u) {
          const float z = cloud.depth_m[static_cast<std::size_t>(v * 50 + u)];
          if (z > 0.0f) least = std::min(least, z);
        }
      }
      ASSERT_EQ(field.nearest(col, row, static_cast<float>(radius)), least) << radius;
    }
  }
  // Between two prepared radii the larger one is used; beyond the largest, the largest.
  EXPECT_EQ(field.nearest(25, 20, 2.5f), field.nearest(25, 20, 4.0f));
  EXPECT_EQ(field.nearest(25, 20, 100.0f), field.nearest(25, 20, 16.0f));
}

}  // namespace
}  // namespace pocd
