// align(): how a thing that stands beside its place got there.
#include <gtest/gtest.h>

#include "known_things.hpp"
#include "pocd/observe/look.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kFenceClass;
using test::KnownThings;
using test::room_with;
using test::solid;

struct Motion {
  Eigen::Vector2d shift{0.0, 0.0};
  double turn_rad = 0.0;
};

/// Looks from the whole sway: most of them say how far the thing moved, and none says it wrongly.
/// `tolerance_m`: half a voxel of alignment and as much of noise; `tolerance_rad` likewise.
void expect_found(KnownThings& known, const Eigen::Vector2d& from, const Eigen::Vector3d& size_m,
                  double yaw_rad, const Motion& motion, ClassId class_id, double tolerance_m,
                  double tolerance_rad) {
  const Eigen::Vector2d to = from + motion.shift;
  const Scene scene = room_with({solid(class_id, to, size_m, yaw_rad + motion.turn_rad)});
  int found = 0;
  for (std::uint64_t i = 0; i < 8; ++i) {
    const Look& look = known.look_at_only(scene, test::swaying_camera(5 * i));
    if (look.verdict != Verdict::kDisplaced) continue;
    ++found;
    const Eigen::Vector3d center(from.x(), from.y(), 0.5 * size_m.z());
    const Eigen::Vector3d error =
        look.T_new_old * center - Eigen::Vector3d(to.x(), to.y(), 0.5 * size_m.z());
    EXPECT_LT(error.norm(), tolerance_m) << "by " << motion.shift.transpose();
    const Eigen::Vector3d x = look.T_new_old.linear() * Eigen::Vector3d::UnitX();
    EXPECT_NEAR(std::atan2(x.y(), x.x()), motion.turn_rad, tolerance_rad);
    EXPECT_NEAR(x.z(), 0.0, 0.05) << "it stands upright";
  }
  EXPECT_GE(found, 6) << "seed " << known.seed << ": " << motion.shift.transpose() << " turned "
                      << motion.turn_rad;
}

TEST(Align, SmallShiftsAreFound) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    KnownThings known;
    known.seed = seed;
    const double yaw = random.uniform(-0.5, 0.5);
    const Eigen::Vector2d from(random.uniform(-0.2, 0.2), random.uniform(2.1, 2.3));
    const Eigen::Vector3d size(0.6, 0.4, 0.6);
    known.learn(solid(kBoxClass, from, size, yaw));
    const double angle = random.uniform(-M_PI, M_PI), far = random.uniform(0.15, 0.3);
    expect_found(known, from, size, yaw, {{far * std::cos(angle), far * std::sin(angle)}, 0.0},
                 kBoxClass, 0.10, 0.12);
  }
}

TEST(Align, TheSignTellsNearerFromFarther) {
  for (const double step_m : {-0.2, 0.2}) {
    KnownThings known;
    known.learn(solid(kBoxClass, {0.0, 2.3}, {0.6, 0.4, 0.6}, 0.3));
    const Look& look = known.look_at_only(
        room_with({solid(kBoxClass, {0.0, 2.3 + step_m}, {0.6, 0.4, 0.6}, 0.3)}));
    ASSERT_EQ(look.verdict, Verdict::kDisplaced) << step_m;
    EXPECT_EQ(look.sign, step_m < 0.0 ? 1 : -1);
    EXPECT_NEAR(look.displacement_m, 0.2, 0.05);
  }
}

TEST(Align, TurnsAreFound) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(100 + seed);
    KnownThings known;
    known.seed = seed;
    const double yaw = random.uniform(-0.1, 0.1);
    const Eigen::Vector3d size(1.0, 0.4, 0.7);
    known.learn(solid(kBoxClass, {0.0, 2.4}, size, yaw));
    const double turn = (random.below(2) ? 1.0 : -1.0) * random.uniform(0.45, 0.6);
    expect_found(known, {0.0, 2.4}, size, yaw, {{0.0, 0.0}, turn}, kBoxClass, 0.12, 0.12);
  }
}

// A wall's face is the same wherever it slid to: only its ends tell.
TEST(Align, SlidesAlongAWallAreFound) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(200 + seed);
    KnownThings known;
    known.seed = seed;
    const Eigen::Vector3d size(1.2, 0.1, 0.9);
    const double yaw = random.uniform(-0.15, 0.15);
    const double slid = (random.below(2) ? 1.0 : -1.0) * random.uniform(0.4, 0.6);
    const Eigen::Vector2d from(slid > 0 ? -0.3 : 0.3, 2.5);
    known.learn(solid(kFenceClass, from, size, yaw));
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw));
    expect_found(known, from, size, yaw, {slid * along, 0.0}, kFenceClass, 0.08, 0.06);
  }
}

// What was made of the points that nobody explained at the new place is no other thing yet.
TEST(Align, ACandidateAtTheNewPlaceDoesNotHinder) {
  KnownThings known;
  const Eigen::Vector3d size(0.6, 0.4, 0.6);
  known.learn(solid(kBoxClass, {0.0, 2.3}, size, 0.3));
  LibraryObject& there = known.learn(solid(kBoxClass, {0.2, 2.3}, size, 0.3));
  const Scene scene = room_with({solid(kBoxClass, {0.2, 2.3}, size, 0.3)});
  there.confirmed = false;
  EXPECT_EQ(known.look(scene, known.eye)[0].verdict, Verdict::kDisplaced);
  there.confirmed = true;
  EXPECT_NE(known.look(scene, known.eye)[0].verdict, Verdict::kDisplaced)
      << "a known thing in its place is another one";
}

TEST(Align, ADifferentThingInItsPlaceIsNotTheDisplacedOne) {
  KnownThings known;
  known.learn(solid(kBoxClass, {0.0, 2.3}, {0.4, 0.4, 1.1}));
  const Look& look =
      known.look_at_only(room_with({solid(kBoxClass, {0.25, 2.2}, {1.2, 0.6, 0.35}, 0.5)}));
  EXPECT_NE(look.verdict, Verdict::kDisplaced);
}

TEST(Align, WhatStandsFartherThanTheLimitIsNotAligned) {
  KnownThings known;
  known.config.association.max_distance_m = 0.3;
  known.learn(solid(kBoxClass, {-0.3, 2.3}, {0.6, 0.4, 0.6}));
  const Look& look =
      known.look_at_only(room_with({solid(kBoxClass, {0.15, 2.3}, {0.6, 0.4, 0.6})}));
  EXPECT_NE(look.verdict, Verdict::kDisplaced);
}

// Noise, wandering poses, other viewpoints, and neighbours that come and go: nothing moved.
TEST(Align, AStillThingIsNeverDisplaced) {
  int looked = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(300 + seed);
    KnownThings known;
    known.seed = seed;
    const Eigen::Vector3d size(random.uniform(0.3, 1.2), random.uniform(0.1, 0.5),
                               random.uniform(0.4, 1.0));
    const SceneObject thing =
        solid(kBoxClass, {random.uniform(-0.2, 0.2), random.uniform(2.1, 2.6)}, size,
              random.uniform(-0.8, 0.8));
    known.learn(thing);
    for (int i = 0; i < 12; ++i) {
      std::vector<SceneObject> things{thing};
      if (i % 3 == 1) {  // a like one, close beside it or before a part of it
        things.push_back(solid(kBoxClass, {random.uniform(-0.9, 0.9), random.uniform(1.5, 1.7)},
                               {0.3, 0.3, random.uniform(0.3, 0.9)}, random.uniform(-0.8, 0.8)));
      }
      Pose eye = test::look_from({random.uniform(-0.4, 0.4), random.uniform(-0.2, 0.1), 1.0},
                                 random.uniform(-0.1, 0.1));
      Frame frame = test::shoot(room_with(things), eye, static_cast<std::uint64_t>(i));
      test::add_noise(frame, known.config.depth_noise, seed);
      for (int d = 0; d < 3; ++d) frame.T_W_C.translation()[d] += random.uniform(-0.02, 0.02);
      frame.T_W_C.rotate(
          Eigen::AngleAxisd(random.uniform(-0.005, 0.005), Eigen::Vector3d::UnitY()));
      const test::Segmented s = test::segment(frame, known.config);
      DepthField field;
      field.update(s.cloud);
      Look look;
      look.object = known.library.all().begin()->second.get();
      judge(s.cloud, field, s.observations, known.sight(), known.config.depth_noise, look);
      align(s.cloud, field, s.observations, known.sight(), known.config.depth_noise,
            known.config.association, known.least_m(), &look, 1, look);
      ASSERT_NE(look.verdict, Verdict::kDisplaced)
          << "seed " << seed << " look " << i << " by " << look.displacement_m;
      ASSERT_NE(look.verdict, Verdict::kUnobserved) << "seed " << seed << " look " << i;
      looked += look.verdict == Verdict::kInPlace;
    }
  }
  EXPECT_GT(looked, 60);
}

}  // namespace
}  // namespace pocd
