#include "pocd/observe/look.hpp"

#include <gtest/gtest.h>

#include "known_things.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::KnownThings;
using test::kPersonClass;
using test::room_with;
using test::solid;

const Eigen::Vector3d kSize(0.6, 0.4, 0.6);
SceneObject the_box() { return solid(kBoxClass, {0.0, 2.3}, kSize); }

TEST(IsInside, FollowsTheTurnedBoxAndItsMargin) {
  OrientedBox box;
  box.pose.position_W = {1, 2, 0.5};
  box.pose.yaw_rad = 0.5 * M_PI;
  box.size_m = {2.0, 0.4, 1.0};
  EXPECT_TRUE(is_inside(box, 0.0, {1.0f, 2.9f, 0.5f})) << "its long side lies along y";
  EXPECT_FALSE(is_inside(box, 0.0, {1.9f, 2.0f, 0.5f}));
  EXPECT_FALSE(is_inside(box, 0.0, {1.0f, 2.0f, 1.05f}));
  EXPECT_TRUE(is_inside(box, 0.1, {1.0f, 2.0f, 1.05f}));
}

TEST(Verdicts, HaveNames) {
  EXPECT_STREQ(to_string(Verdict::kInPlace), "in_place");
  EXPECT_STREQ(to_string(Verdict::kUnobserved), "unobserved");
}

TEST(Judge, InPlace) {
  KnownThings known;
  known.learn(the_box());
  const Look& look = known.look_at_only(room_with({the_box()}));
  EXPECT_EQ(look.verdict, Verdict::kInPlace);
  EXPECT_FALSE(look.contested);
  EXPECT_TRUE(look.fits);
  ASSERT_NE(look.observation, Observations::kNone);
  EXPECT_EQ(known.now.observations.list[look.observation].class_id, kBoxClass);
  EXPECT_EQ(look.displacement_m, 0.0);
}

TEST(Judge, UnobservedWhenItsPlaceIsSeenThrough) {
  KnownThings known;
  known.learn(the_box());
  const Look& look = known.look_at_only(room_with({}));
  EXPECT_EQ(look.verdict, Verdict::kUnobserved);
  EXPECT_TRUE(look.contested);
  EXPECT_GT(look.sighting.seen_through_share(), 0.8);
  EXPECT_EQ(look.observation, Observations::kNone);
}

TEST(Judge, HiddenWhetherThereOrNot) {
  KnownThings known;
  known.learn(the_box());
  for (const ClassId screen : {kCageClass, kPersonClass}) {
    for (const bool there : {true, false}) {
      std::vector<SceneObject> things{solid(screen, {0.05, 1.3}, {1.6, 0.1, 1.5})};
      if (there) things.push_back(the_box());
      EXPECT_EQ(known.look_at_only(room_with(things)).verdict, Verdict::kHidden) << screen << there;
    }
  }
}

TEST(Judge, TooLittleSeen) {
  KnownThings known;
  known.learn(the_box());
  EXPECT_EQ(known.look_at_only(room_with({}), test::look_from({0, 0, 1}, M_PI)).verdict,
            Verdict::kTooLittleSeen)
      << "behind the camera";
  known.config.map.max_depth_m = 1.5;
  EXPECT_EQ(known.look_at_only(room_with({})).verdict, Verdict::kTooLittleSeen)
      << "beyond the depth limit";
  known.config.map.max_depth_m = 4.0;
  known.learn(the_box());
  ObjectModel& model = known.library.all().begin()->second->model;
  std::vector<std::uint8_t> marked(model.surfels().size(), 1);
  for (std::size_t i = 0; i < 4; ++i) marked[i] = 0;
  model.extract(marked);
  EXPECT_EQ(known.look_at_only(room_with({})).verdict, Verdict::kTooLittleSeen)
      << "four points say nothing";
}

TEST(Judge, HolesSayNothing) {
  KnownThings known;
  LibraryObject& object = known.learn(the_box());
  Frame frame = test::shoot(room_with({}), known.eye);
  frame.depth_m.setTo(0.0f);
  const test::Segmented s = test::segment(frame, known.config);
  DepthField field;
  field.update(s.cloud);
  Look look;
  look.object = &object;
  judge(s.cloud, field, s.observations, known.sight(), known.config.depth_noise, look);
  EXPECT_EQ(look.verdict, Verdict::kTooLittleSeen);
  EXPECT_FALSE(look.contested);
}

TEST(Judge, ContestedWhenAGoodPartOfItIsGone) {
  // The upper third of a stack is taken off: it is in its place, but nothing grows on it now.
  KnownThings known;
  known.learn(solid(kBoxClass, {0.0, 2.3}, {0.6, 0.4, 1.2}));
  const Look& look =
      known.look_at_only(room_with({solid(kBoxClass, {0.0, 2.3}, {0.6, 0.4, 0.75})}));
  EXPECT_EQ(look.verdict, Verdict::kInPlace);
  EXPECT_TRUE(look.contested);
  EXPECT_TRUE(look.fits) << "what stands there is its surface";
}

TEST(Judge, ResemblanceElsewhereSaysNothing) {
  KnownThings known;
  known.learn(the_box());
  const Look& look = known.look_at_only(room_with({solid(kBoxClass, {1.1, 2.3}, kSize)}));
  EXPECT_EQ(look.verdict, Verdict::kUnobserved);
}

TEST(Judge, AThingOfAnotherClassInItsPlaceIsNotTheThing) {
  KnownThings known;
  known.learn(the_box());
  const Look& look = known.look_at_only(room_with({solid(kCageClass, {0.0, 2.3}, kSize)}));
  EXPECT_EQ(look.verdict, Verdict::kHidden);
  EXPECT_TRUE(look.contested);
  EXPECT_EQ(look.sighting.hit, look.sighting.total) << "it coincides";
}

// Another thing stands where it was and coincides with a part of its surface.
TEST(Judge, WhatCoincidesWithAnotherThingDoesNotStand) {
  KnownThings known;
  known.learn(solid(kBoxClass, {0.0, 2.3}, {0.5, 0.5, 0.9}));
  // A lower one whose face runs through its place aslant.
  const Look& look =
      known.look_at_only(room_with({solid(kBoxClass, {0.12, 2.42}, {1.1, 0.5, 0.5}, 0.45)}));
  EXPECT_FALSE(look.fits);
  EXPECT_EQ(look.verdict, Verdict::kUnobserved);
  EXPECT_LT(look.sighting.seen_through_share(), 1.0) << "some of it coincides";
  // The thing itself, at most in part, fits.
  EXPECT_TRUE(known.look_at_only(room_with({solid(kBoxClass, {0.0, 2.3}, {0.5, 0.5, 0.9})})).fits);
}

TEST(Judge, ANewObjectBearsWitnessFromItsFirstPointsOn) {
  for (const int frames : {1, 2}) {
    KnownThings known;
    known.learn(the_box(), frames);
    EXPECT_EQ(known.look_at_only(room_with({the_box()})).verdict, Verdict::kInPlace) << frames;
    EXPECT_EQ(known.look_at_only(room_with({})).verdict, Verdict::kUnobserved) << frames;
  }
}

}  // namespace
}  // namespace pocd
