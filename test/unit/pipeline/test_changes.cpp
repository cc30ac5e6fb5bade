// What the pipeline says when something changed, and what the map holds then.
#include <gtest/gtest.h>

#include <algorithm>

#include "drive.hpp"

namespace pocd {
namespace {

using test::Drive;
using test::kBoxClass;
using test::kCageClass;
using test::kLearn;
using test::kPromptly;
using test::kSize;
using test::left_box;
using test::right_cage;
using test::room_with;
using test::solid;
using test::text;

TEST(PipelineChanges, ThingsAreAddedOnceWithTheirClassAndPlace) {
  Drive drive;
  drive.watch(room_with({left_box(), right_cage()}), kLearn);
  const auto added = drive.of_kind(EventKind::kAdded);
  ASSERT_EQ(added.size(), 2u) << text(drive.events());
  const auto box = drive.object_at(-0.6, 2.3);
  const auto cage = drive.object_at(0.7, 2.4);
  ASSERT_TRUE(box && cage);
  EXPECT_EQ(box->class_id, kBoxClass);
  EXPECT_EQ(cage->class_id, kCageClass);
  EXPECT_LT((box->box.pose.position_W - Eigen::Vector3d(-0.6, 2.3, 0.3)).norm(), 0.08);
  EXPECT_NEAR(box->box.size_m.z(), 0.6, 0.08) << "it stands on the floor";
  EXPECT_GT(box->belief.stationarity(), 0.67) << "seen in place, it is trusted more than at first";
  EXPECT_GT(drive.voxels_of(box->id), 100u);
  for (const ObjectEvent& e : added) EXPECT_GE(e.frame_sequence, 2u) << "not on first sight";
}

TEST(PipelineChanges, SequenceNumbersHaveNoGaps) {
  Drive drive;
  drive.watch(room_with({left_box(), right_cage()}), kLearn);
  drive.watch(room_with({right_cage()}), kLearn);
  ASSERT_GE(drive.events().size(), 3u);
  for (std::size_t i = 0; i < drive.events().size(); ++i)
    EXPECT_EQ(drive.events()[i].sequence, i + 1);
}

TEST(PipelineChanges, RemovedBoxIsReportedAndItsVoxelsAreGone) {
  Drive drive;
  drive.watch(room_with({left_box(), right_cage()}), kLearn);
  const auto box = drive.object_at(-0.6, 2.3);
  const auto cage = drive.object_at(0.7, 2.4);
  ASSERT_TRUE(box && cage);
  const std::size_t cage_voxels = drive.voxels_of(cage->id);
  ASSERT_GT(drive.voxels_of(box->id), 100u);

  const int frames = drive.watch_for(EventKind::kRemoved, room_with({right_cage()}), kPromptly);
  ASSERT_GT(frames, 0) << text(drive.events());
  const ObjectEvent removed = drive.of_kind(EventKind::kRemoved)[0];
  EXPECT_EQ(removed.object, box->id);
  EXPECT_EQ(removed.class_id, kBoxClass);
  EXPECT_FALSE(removed.previous_box);
  EXPECT_LT((removed.box.pose.position_W - box->box.pose.position_W).norm(), 0.05);
  EXPECT_GT(removed.evidence.seen_through_share, 0.5);
  // Exactly its voxels: none of it is left at once, and its neighbour has all of its own.
  EXPECT_EQ(drive.voxels_of(box->id), 0u);
  EXPECT_GE(drive.voxels_of(cage->id), cage_voxels);
  EXPECT_FALSE(drive.object_at(-0.6, 2.3));
  // And nothing solid is where it was, two voxels above the floor and 4 cm inside of its sides.
  drive.watch(room_with({right_cage()}), 5);
  EXPECT_EQ(drive.solid_voxels_in({-0.86, 2.14, 0.1}, {-0.34, 2.46, 0.56}), 0u);
  EXPECT_TRUE(drive.object_at(0.7, 2.4));
}

TEST(PipelineChanges, RetiredIdsAreThoseOfRemovedObjects) {
  Drive drive;
  drive.watch(room_with({left_box()}), kLearn);
  const auto box = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(box);
  for (int i = 0; i < kPromptly; ++i) {
    const FrameResult result = drive.process(drive.next_frame(room_with({})));
    if (result.retired.empty()) continue;
    EXPECT_EQ(result.retired, std::vector<ObjectId>{box->id});
    ASSERT_EQ(result.events.size(), 1u);
    EXPECT_EQ(result.events[0].kind, EventKind::kRemoved);
    for (const auto& changed : result.changed_objects) EXPECT_NE(changed.id, box->id);
    return;
  }
  FAIL() << text(drive.events());
}

TEST(PipelineChanges, MovedBoxKeepsItsIdentityAndNamesBothPlaces) {
  Drive drive;
  drive.watch(room_with({left_box(), right_cage()}), kLearn);
  const auto box = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(box);
  // 35 cm: the old and the new place overlap.
  const Scene after = room_with({solid(kBoxClass, {-0.25, 2.2}, kSize), right_cage()});
  const int frames = drive.watch_for(EventKind::kMoved, after, 2 * kPromptly);
  ASSERT_GT(frames, 0) << text(drive.events());
  drive.watch(after, 10);
  const auto moved = drive.of_kind(EventKind::kMoved);
  ASSERT_EQ(moved.size(), 1u) << text(drive.events());
  EXPECT_EQ(moved[0].object, box->id);
  ASSERT_TRUE(moved[0].previous_box);
  EXPECT_LT((moved[0].previous_box->pose.position_W - Eigen::Vector3d(-0.6, 2.3, 0.3)).norm(), 0.1);
  EXPECT_LT((moved[0].box.pose.position_W - Eigen::Vector3d(-0.25, 2.2, 0.3)).norm(), 0.15);
  EXPECT_TRUE(drive.of_kind(EventKind::kRemoved).empty()) << text(drive.events());
  const auto now = drive.object_at(-0.25, 2.2);
  ASSERT_TRUE(now);
  EXPECT_EQ(now->id, box->id);
  EXPECT_EQ(now->first_seen_ns, box->first_seen_ns) << "it is as old as before";
  EXPECT_EQ(drive.solid_voxels_in({-0.86, 2.14, 0.1}, {-0.6, 2.46, 0.56}), 0u)
      << "where it was alone";
}

TEST(PipelineChanges, SmallMovesAreMovesToo) {
  // Towards the camera: nothing of the old place is seen through. Up to 10 cm, the margin of sight
  // at voxels of 5 cm, a surface is in its place.
  for (const double step_m : {0.20, 0.15}) {
    Drive drive;
    drive.watch(room_with({left_box(), right_cage()}), kLearn);
    const auto box = drive.object_at(-0.6, 2.3);
    ASSERT_TRUE(box);
    const Scene after = room_with({solid(kBoxClass, {-0.6, 2.3 - step_m}, kSize), right_cage()});
    ASSERT_GT(drive.watch_for(EventKind::kMoved, after, kPromptly), 0) << text(drive.events());
    drive.watch(after, 15);
    EXPECT_EQ(drive.of_kind(EventKind::kMoved).size(), 1u) << text(drive.events());
    EXPECT_TRUE(drive.of_kind(EventKind::kRemoved).empty()) << text(drive.events());
    const auto now = drive.object_at(-0.6, 2.3 - step_m);
    ASSERT_TRUE(now);
    EXPECT_EQ(now->id, box->id);
    // Half a voxel of alignment and as much of the box's depth, of which only the top tells.
    EXPECT_NEAR((now->box.pose.position_W - box->box.pose.position_W).y(), -step_m, 0.05);
  }
}

// Farther than it is long, but near: no other origin has to be waited for.
TEST(PipelineChanges, AShortMoveOfASmallThingIsToldAtOnce) {
  const Eigen::Vector3d small(0.3, 0.3, 0.6);
  Drive drive;
  drive.watch(room_with({solid(kBoxClass, {-0.5, 2.2}, small), right_cage()}), kLearn);
  const auto box = drive.object_at(-0.5, 2.2);
  ASSERT_TRUE(box);
  const Scene after = room_with({solid(kBoxClass, {-0.08, 2.1}, small, 0.5), right_cage()});
  ASSERT_GT(drive.watch_for(EventKind::kMoved, after, kPromptly), 0) << text(drive.events());
  EXPECT_EQ(drive.of_kind(EventKind::kMoved)[0].object, box->id);
}

// A fifth of a metre and more, whichever way, along or across the view: one thing, at another
// place.
TEST(PipelineChanges, AThingThatIsPushedKeepsItsIdentity) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const double yaw = random.uniform(-0.4, 0.4);
    const double angle = 2.0 * M_PI * static_cast<double>(seed) / 8.0;
    const double far_m = random.uniform(0.2, 0.35);
    const Eigen::Vector2d from(0.0, 2.3),
        to = from + far_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    Drive drive;
    drive.watch(room_with({solid(kBoxClass, from, kSize, yaw)}), kLearn);
    drive.watch(room_with({solid(kBoxClass, to, kSize, yaw)}), 2 * kPromptly);
    const auto moved = drive.of_kind(EventKind::kMoved);
    ASSERT_EQ(moved.size(), 1u) << far_m << " towards " << angle << "\n" << text(drive.events());
    EXPECT_LT((moved[0].box.pose.position_W.head<2>() - to).norm(), 0.1);
    EXPECT_EQ(moved[0].object, drive.events()[0].object) << text(drive.events());
    for (const ObjectEvent& e : drive.of_kind(EventKind::kRemoved))
      EXPECT_NE(e.object, moved[0].object) << text(drive.events());
  }
}

// Sides that come into view one after the other, aslant at first, are sides of one thing.
TEST(PipelineChanges, OneThingIsOneObjectHoweverItIsTurned) {
  for (int k = 0; k <= 16; ++k) {
    Drive drive;
    const double yaw = -0.4 + 0.05 * k;
    drive.watch(room_with({solid(kBoxClass, {0.0, 2.3}, kSize, yaw)}), 40);
    EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 1u) << yaw << "\n" << text(drive.events());
    EXPECT_EQ(drive.pipeline().objects().size(), 1u) << yaw;
  }
}

// Two boxes that touch arrive together: what touches a thing that came a moment before would be a
// side of it, but for the masks.
TEST(PipelineChanges, WhatMasksShowAsTwoInstancesIsTwoThings) {
  PipelineConfig config = test::room_config();
  config.classes.label_divisor = 100;
  for (const bool told_apart : {true, false}) {
    Drive drive(config);
    const auto watch = [&](const Scene& scene, int frames) {
      for (int i = 0; i < frames; ++i)
        drive.process(test::masks_of_instances(drive.next_frame(scene), told_apart));
    };
    watch(room_with({right_cage()}), kLearn);
    watch(room_with({solid(kBoxClass, {-0.3, 2.3}, kSize),
                     solid(test::kSecondBox, {0.3, 2.3}, kSize), right_cage()}),
          2 * kPromptly);
    std::size_t boxes = 0;
    for (const ObjectSnapshot& object : drive.pipeline().objects())
      boxes += object.class_id == kBoxClass;
    EXPECT_EQ(boxes, told_apart ? 2u : 1u) << text(drive.events());
  }
}

// What was known of a thing goes with it: of a moved one that is half hidden, the whole is known.
TEST(PipelineChanges, AMovedThingKeepsItsUnseenSides) {
  constexpr double kLength = 1.0;
  const Eigen::Vector3d size(kLength, 0.4, 0.6);
  Drive drive;
  drive.watch(room_with({solid(kBoxClass, {-0.6, 2.4}, size)}), kLearn);
  const auto before = drive.object_at(-0.6, 2.4);
  ASSERT_TRUE(before);
  const SceneObject screen = solid(kCageClass, {0.75, 1.5}, {0.7, 0.1, 1.2});
  drive.watch(room_with({solid(kBoxClass, {0.35, 2.4}, size), screen}), 3 * kPromptly);
  const auto moved = drive.of_kind(EventKind::kMoved);
  ASSERT_EQ(moved.size(), 1u) << text(drive.events());
  EXPECT_EQ(moved[0].object, before->id);
  EXPECT_NEAR(longest_side(moved[0].box), kLength, 0.1);
  // Up to 15 % of the surface may contradict a motion: so far it may slide along a hidden end.
  EXPECT_NEAR(moved[0].box.pose.position_W.x(), 0.35, 0.15 * kLength);
}

TEST(PipelineChanges, NewBoxIsAdded) {
  Drive drive;
  drive.watch(room_with({right_cage()}), kLearn);
  const Scene after = room_with({left_box(), right_cage()});
  ASSERT_GT(drive.watch_for(EventKind::kAdded, after, kPromptly), 0) << text(drive.events());
  drive.watch(after, 10);
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
  EXPECT_TRUE(drive.of_kind(EventKind::kMoved).empty());
  EXPECT_TRUE(drive.of_kind(EventKind::kRemoved).empty());
  EXPECT_TRUE(drive.object_at(-0.6, 2.3));
}

TEST(PipelineChanges, ThingOfAnotherClassInItsPlaceIsNotAMove) {
  Drive drive;
  drive.watch(room_with({left_box()}), kLearn);
  drive.watch(room_with({solid(kCageClass, {0.3, 2.3}, kSize)}), 2 * kPromptly);
  EXPECT_EQ(drive.of_kind(EventKind::kRemoved).size(), 1u) << text(drive.events());
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
  EXPECT_TRUE(drive.of_kind(EventKind::kMoved).empty()) << text(drive.events());
}

TEST(PipelineChanges, BoxThatComesBackElsewhereLaterHasMoved) {
  Drive drive;
  drive.watch(room_with({left_box()}), kLearn);
  const auto box = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(box);
  drive.watch(room_with({}), 2 * kPromptly);
  ASSERT_EQ(drive.of_kind(EventKind::kRemoved).size(), 1u) << text(drive.events());
  const Scene after = room_with({solid(kBoxClass, {0.7, 2.3}, kSize)});
  ASSERT_GT(drive.watch_for(EventKind::kMoved, after, kLearn), 0) << text(drive.events());
  EXPECT_EQ(drive.of_kind(EventKind::kMoved)[0].object, box->id);
  EXPECT_TRUE(drive.object_at(0.7, 2.3));
}

// A thing whose distance was wrong when it was first seen is neither there nor gone: what holds its
// place is given up, and it is found anew.
TEST(PipelineChanges, ThingFirstSeenAtAWrongDistanceIsAdded) {
  Drive drive;
  drive.watch(room_with({right_cage()}), kLearn);
  drive.watch(room_with({right_cage(), solid(kBoxClass, {-0.6, 2.45}, kSize)}), 1);
  const Scene scene = room_with({right_cage(), left_box()});
  drive.watch(scene, 2 * kPromptly);
  const auto box = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(box) << text(drive.events());
  EXPECT_NEAR(box->box.pose.position_W.y() - 0.5 * box->box.size_m.y(), 2.1, 0.08) << "its face";
  EXPECT_GT(drive.voxels_of(box->id), 100u);
}

// Surfels at outlines come and go while poses err; an object that is old for that is an object as
// any other, whose move is recognised.
TEST(PipelineChanges, OldThingsMoveAsNewOnesDo) {
  Drive drive;
  const auto watch = [&](const Scene& scene, int frames) {
    for (int i = 0; i < frames; ++i) {
      Frame frame = drive.next_frame(scene);
      const double t = 0.1 * static_cast<double>(drive.frames());
      frame.T_W_C.pretranslate(Eigen::Vector3d(0.025 * std::sin(t), 0.02 * std::cos(1.3 * t), 0.0));
      drive.process(frame);
    }
  };
  watch(room_with({left_box(), right_cage()}), 600);
  ASSERT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
  const auto box = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(box);
  watch(room_with({solid(kBoxClass, {-0.6, 1.5}, kSize), right_cage()}), 3 * kPromptly);
  const auto moved = drive.of_kind(EventKind::kMoved);
  ASSERT_EQ(moved.size(), 1u) << text(drive.events());
  EXPECT_EQ(moved[0].object, box->id);
  // It went farther than its own length: until nearer things had time to show, it is one that left
  // and one that came.
  const auto added = drive.of_kind(EventKind::kAdded);
  ASSERT_EQ(added.size(), 3u) << text(drive.events());
  EXPECT_EQ(moved[0].absorbed, added[2].object);
  EXPECT_EQ(drive.pipeline().objects().size(), 2u);
}

TEST(PipelineChanges, EventsNameFrameAndRobot) {
  Drive drive;
  const Scene scene = room_with({left_box()});
  for (int i = 0; i < kLearn; ++i) {
    Frame frame = drive.next_frame(scene);
    frame.robot = "r7";
    const FrameResult result = drive.process(frame);
    for (const ObjectEvent& e : result.events) {
      EXPECT_EQ(e.robot, "r7");
      EXPECT_EQ(e.frame_sequence, frame.sequence);
      EXPECT_EQ(e.stamp_ns, frame.stamp_ns);
    }
  }
  EXPECT_FALSE(drive.events().empty());
  EXPECT_EQ(drive.object_at(-0.6, 2.3)->last_robot, "r7");
}

// Below a tenth of a square metre. A thing that is in its place is known to be, however small it
// is: one that came before it went is another one.
TEST(PipelineChanges, ASmallThingIsNotMovedToALikeOneThatCameBefore) {
  const Eigen::Vector3d small(0.18, 0.18, 0.2);
  const SceneObject first = solid(kBoxClass, {-0.5, 1.6}, small);
  const SceneObject second = solid(kBoxClass, {0.3, 1.6}, small);
  Drive drive;
  drive.watch(room_with({first}), kLearn);
  const auto known = drive.object_at(-0.5, 1.6);
  ASSERT_TRUE(known);
  drive.watch(room_with({first, second}), kLearn);
  ASSERT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
  drive.watch(room_with({second}), 2 * kLearn);
  EXPECT_TRUE(drive.of_kind(EventKind::kMoved).empty()) << text(drive.events());
  const auto removed = drive.of_kind(EventKind::kRemoved);
  ASSERT_EQ(removed.size(), 1u) << text(drive.events());
  EXPECT_EQ(removed[0].object, known->id);
}

}  // namespace
}  // namespace pocd
