// A thing that is seen from one side at a time is one thing all the same.
#include <gtest/gtest.h>

#include "drive.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::look_from;
using test::room_with;
using test::shoot;
using test::solid;
using test::text;

const Eigen::Vector2d kPlace_W(0.0, 1.7);
const Eigen::Vector3d kSize_m(0.8, 0.6, 1.2);  ///< higher than the camera: its top is not seen

/// A robot that looks at the place from one side, drives off for longer than a visit lasts, and
/// comes back on another side.
class Sides : public ::testing::Test {
 protected:
  void visit(const Scene& scene, double heading_rad) {
    count_ += 15 * 20;
    watch(scene, heading_rad);
  }
  /// Within the same visit.
  void watch(const Scene& scene, double heading_rad) {
    constexpr int kFrames = 40;
    for (int i = 0; i < kFrames; ++i) {
      const double yaw_rad = heading_rad + 0.05 * std::sin(0.3 * i);
      const Eigen::Vector2d eye =
          kPlace_W - 1.6 * Eigen::Vector2d(-std::sin(yaw_rad), std::cos(yaw_rad));
      Frame frame = shoot(scene, look_from({eye.x(), eye.y(), 1.0}, yaw_rad, 0.1), count_++);
      test::add_noise(frame, config_.depth_noise, 5);
      drive_.process(frame);
    }
  }
  std::size_t boxes() {
    const auto objects = drive_.pipeline().objects();
    return static_cast<std::size_t>(
        std::count_if(objects.begin(), objects.end(),
                      [](const ObjectSnapshot& o) { return o.class_id == kBoxClass; }));
  }
  std::size_t count(EventKind kind) {
    const auto events = drive_.of_kind(kind);
    return static_cast<std::size_t>(
        std::count_if(events.begin(), events.end(),
                      [](const ObjectEvent& e) { return e.class_id == kBoxClass; }));
  }

  PipelineConfig config_ = test::room_config();
  test::Drive drive_{config_};
  std::uint64_t count_ = 0;
};

constexpr double kFront = 0.0, kBack = M_PI;

TEST_F(Sides, FrontAndBackAreOneObject) {
  const Scene scene = room_with({solid(kBoxClass, kPlace_W, kSize_m)});
  visit(scene, kFront);
  EXPECT_EQ(boxes(), 1u);
  visit(scene, kBack);
  visit(scene, kFront);
  EXPECT_EQ(boxes(), 1u) << text(drive_.events());
  EXPECT_EQ(count(EventKind::kRemoved) + count(EventKind::kMoved), 0u);
  const auto box = drive_.object_at(kPlace_W.x(), kPlace_W.y());
  ASSERT_TRUE(box);
  EXPECT_NEAR(box->box.size_m.head<2>().maxCoeff(), 0.8, 0.12);
  EXPECT_NEAR(box->box.size_m.head<2>().minCoeff(), 0.6, 0.12) << "both sides";
}

// The back is seen so soon after the front that the space around is not known: it may be another
// thing. On the next visit it is.
TEST_F(Sides, WhatOneVisitShowedAsTwoIsOneOnTheNext) {
  const Scene scene = room_with({solid(kBoxClass, kPlace_W, kSize_m)});
  visit(scene, kFront);
  watch(scene, kBack);
  ASSERT_EQ(boxes(), 2u) << text(drive_.events());
  visit(scene, kFront);
  EXPECT_EQ(boxes(), 1u) << text(drive_.events());
}

TEST_F(Sides, TwoThingsWithFreeSpaceBetweenStayTwo) {
  const Eigen::Vector3d plate_m(0.8, 0.08, 1.2);
  const Scene scene =
      room_with({solid(kBoxClass, {0.0, 1.4}, plate_m), solid(kBoxClass, {0.0, 2.1}, plate_m)});
  visit(scene, kFront);
  visit(scene, M_PI / 2.0);  // from the side: between them
  visit(scene, kBack);
  visit(scene, kFront);
  EXPECT_EQ(boxes(), 2u) << text(drive_.events());
}

// Nothing is seen between two boxes that touch, but the masks say that they are two.
TEST_F(Sides, WhatMasksShowAsTwoInstancesStaysTwo) {
  config_.classes.label_divisor = 100;
  test::Drive drive(config_);
  const Scene scene = room_with({solid(kBoxClass, {-0.25, 1.7}, {0.5, 0.5, 1.2}),
                                 solid(test::kSecondBox, {0.25, 1.7}, {0.5, 0.5, 1.2})});
  std::uint64_t number = 0;
  for (int round = 0; round < 3; ++round) {
    number += 15 * 20;
    for (int i = 0; i < 30; ++i) {
      const Pose eye = look_from({0.1 * std::sin(0.3 * i), 0.0, 1.0}, 0.0);
      drive.process(test::masks_of_instances(shoot(scene, eye, number++)));
    }
  }
  const auto objects = drive.pipeline().objects();
  EXPECT_EQ(std::count_if(objects.begin(), objects.end(),
                          [](const ObjectSnapshot& o) { return o.class_id == kBoxClass; }),
            2)
      << text(drive.events());
  // None was joined with the other one and found anew.
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
}

TEST_F(Sides, TheOtherSideOfWhatWasCarriedOffIsNoThingOfItsOwn) {
  visit(room_with({solid(kBoxClass, kPlace_W, kSize_m)}), kFront);
  visit(room_with({solid(kBoxClass, kPlace_W, kSize_m)}), kBack);
  visit(room_with({}), kFront);
  visit(room_with({}), kBack);
  EXPECT_EQ(boxes(), 0u) << text(drive_.events());
  EXPECT_EQ(count(EventKind::kRemoved), 1u) << text(drive_.events());
}

TEST_F(Sides, WhatMovesTakesItsOtherSideAlong) {
  const Eigen::Vector2d here_W = kPlace_W - Eigen::Vector2d(0.45, 0.0);
  const Eigen::Vector2d there_W = kPlace_W + Eigen::Vector2d(0.45, 0.0);
  visit(room_with({solid(kBoxClass, here_W, kSize_m)}), kFront);
  visit(room_with({solid(kBoxClass, here_W, kSize_m)}), kBack);
  const Scene after = room_with({solid(kBoxClass, there_W, kSize_m)});
  visit(after, kFront);
  EXPECT_EQ(count(EventKind::kMoved), 1u) << text(drive_.events());
  visit(after, kBack);
  visit(after, kFront);
  EXPECT_EQ(boxes(), 1u) << text(drive_.events());
  const auto box = drive_.object_at(there_W.x(), there_W.y());
  ASSERT_TRUE(box);
  EXPECT_NEAR(box->box.size_m.head<2>().minCoeff(), 0.6, 0.15) << "both sides";
}

}  // namespace
}  // namespace pocd
