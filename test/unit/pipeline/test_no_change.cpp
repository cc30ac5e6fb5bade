// What must not look like a change: noise, people, missing masks, hiding, bad poses.
#include <gtest/gtest.h>

#include "drive.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_delta.hpp"

namespace pocd {
namespace {

using test::Drive;
using test::kBoxClass;
using test::kCageClass;
using test::kFenceAlias;
using test::kFenceClass;
using test::kPersonClass;
using test::left_box;
using test::right_cage;
using test::room_with;
using test::solid;
using test::text;

Scene furnished() { return room_with({left_box(), right_cage()}); }

void expect_nothing_removed_or_moved(const Drive& drive) {
  EXPECT_TRUE(drive.of_kind(EventKind::kRemoved).empty()) << text(drive.events());
  EXPECT_TRUE(drive.of_kind(EventKind::kMoved).empty()) << text(drive.events());
}

TEST(PipelineNoChange, StaticSceneWithNoise) {
  Drive drive;
  drive.watch(
      room_with({left_box(), right_cage(), solid(kBoxClass, {-0.1, 2.9}, {0.4, 0.3, 1.1}, 0.5)}),
      100);
  expect_nothing_removed_or_moved(drive);
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 3u) << text(drive.events());
  for (const ObjectSnapshot& o : drive.pipeline().objects()) {
    EXPECT_GT(o.belief.stationarity(), 0.9) << "100 frames in its place";
    EXPECT_LT(std::abs(o.belief.mu), 0.03) << "and nothing was measured to have moved";
  }
}

TEST(PipelineNoChange, LocalisationThatWanders) {
  // Errors of 2 cm and 0.3 degrees that change within seconds, as the shipped sensor model has
  // them.
  Drive drive;
  const Scene scene = furnished();
  for (int i = 0; i < 100; ++i) {
    Frame frame = drive.next_frame(scene);
    const double t = 0.1 * i;
    frame.T_W_C.pretranslate(
        Eigen::Vector3d(0.02 * std::sin(t), 0.02 * std::cos(1.3 * t), 0.005 * std::sin(0.7 * t)));
    frame.T_W_C.rotate(Eigen::AngleAxisd(0.005 * std::sin(0.9 * t), Eigen::Vector3d::UnitY()));
    drive.process(frame);
  }
  expect_nothing_removed_or_moved(drive);
  EXPECT_EQ(drive.pipeline().objects().size(), 2u) << text(drive.events());
}

TEST(PipelineNoChange, PersonLeavesNoTrace) {
  Drive drive;
  // A slow walk from one side to the other, before and between the things.
  for (int i = 0; i < 60; ++i) {
    const double x = -1.2 + 0.04 * i;
    drive.process(drive.next_frame(
        room_with({left_box(), right_cage(), solid(kPersonClass, {x, 1.5}, {0.35, 0.25, 1.6})})));
  }
  drive.watch(furnished(), 20);
  expect_nothing_removed_or_moved(drive);
  for (const ObjectEvent& e : drive.events()) EXPECT_NE(e.class_id, kPersonClass);
  EXPECT_EQ(drive.pipeline().objects().size(), 2u) << text(drive.events());
  // Nothing solid where the walk led, above the floor and before the things.
  EXPECT_EQ(drive.solid_voxels_in({-1.5, 1.3, 0.1}, {1.5, 1.7, 2.0}), 0u);
}

TEST(PipelineNoChange, MissingMasksRemoveNothing) {
  Drive drive;
  drive.watch(furnished(), 25);
  const auto before = drive.pipeline().objects();
  ASSERT_EQ(before.size(), 2u);
  for (int i = 0; i < 25; ++i) {
    Frame frame = drive.next_frame(furnished());
    frame.labels = cv::Mat();
    const FrameResult result = drive.process(frame);
    ASSERT_EQ(result.warnings.size(), 1u) << "it is named";
    EXPECT_NE(result.warnings[0].find("no segmentation image"), std::string::npos);
  }
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << "nothing is made of the default class";
  expect_nothing_removed_or_moved(drive);
  drive.watch(furnished(), 25);
  expect_nothing_removed_or_moved(drive);
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
  const auto after = drive.pipeline().objects();
  ASSERT_EQ(after.size(), 2u) << text(drive.events());
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(after[i].id, before[i].id);
    EXPECT_GT(drive.voxels_of(after[i].id), 100u);
    EXPECT_GT(after[i].belief.stationarity(), 0.6);
  }
}

TEST(PipelineNoChange, WithoutMasksARemovalIsStillSeen) {
  // Depth alone says that the place is empty.
  Drive drive;
  drive.watch(furnished(), 25);
  const auto box = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(box);
  for (int i = 0; i < 15; ++i) {
    Frame frame = drive.next_frame(room_with({right_cage()}));
    frame.labels = cv::Mat();
    drive.process(frame);
  }
  const auto removed = drive.of_kind(EventKind::kRemoved);
  ASSERT_EQ(removed.size(), 1u) << text(drive.events());
  EXPECT_EQ(removed[0].object, box->id);
}

TEST(PipelineNoChange, AliasedMasksAreOneThing) {
  Drive drive;
  const Scene scene = room_with({solid(kFenceClass, {0, 2.6}, {1.6, 0.1, 1.2})});
  for (int i = 0; i < 60; ++i) {
    Frame frame = drive.next_frame(scene);
    // The label flickers between the two indices of the fence, in half of the picture or in all of
    // it.
    for (int v = 0; v < frame.labels.rows; ++v) {
      for (int u = 0; u < frame.labels.cols; ++u) {
        auto& label = frame.labels.at<std::uint16_t>(v, u);
        if (label == kFenceClass && (i % 3 == 1 || (i % 3 == 2 && u < 160))) label = kFenceAlias;
      }
    }
    drive.process(frame);
  }
  expect_nothing_removed_or_moved(drive);
  ASSERT_EQ(drive.pipeline().objects().size(), 1u) << text(drive.events());
  EXPECT_EQ(drive.pipeline().objects()[0].class_id, kFenceClass);
}

TEST(PipelineNoChange, HiddenObjectKeepsItsBelief) {
  Drive drive;
  drive.watch(room_with({left_box()}), 25);
  // A screen before the box; and, which nobody can know, the box is carried off behind it.
  const SceneObject screen = solid(kCageClass, {-0.4, 1.3}, {1.6, 0.1, 1.5});
  drive.watch(room_with({left_box(), screen}), 2);
  const auto hidden = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(hidden);
  drive.watch(room_with({screen}), 40);
  expect_nothing_removed_or_moved(drive);
  const auto still = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(still);
  EXPECT_EQ(still->belief.alpha, hidden->belief.alpha);
  EXPECT_EQ(still->belief.beta, hidden->belief.beta);
  EXPECT_EQ(still->belief.mu, hidden->belief.mu);
  EXPECT_EQ(still->last_seen_ns, hidden->last_seen_ns);
  EXPECT_EQ(drive.voxels_of(still->id), drive.voxels_of(hidden->id));
  // Only when the screen is gone again it is seen to be missing.
  EXPECT_GT(drive.watch_for(EventKind::kRemoved, room_with({}), 20), 0) << text(drive.events());
}

TEST(PipelineNoChange, SpikeOfThePoseIsRefusedAsAWhole) {
  Drive drive;
  drive.watch(furnished(), 25);
  const auto before = drive.pipeline().objects();
  drive.pipeline().map().take_dirty();
  Frame frame = drive.next_frame(furnished());
  frame.T_W_C.pretranslate(Eigen::Vector3d(0.8, 0.0, 0.0));
  const FrameResult result = drive.process(frame);
  EXPECT_FALSE(result.accepted);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("pose jump"), std::string::npos);
  EXPECT_TRUE(result.events.empty());
  EXPECT_TRUE(result.changed_objects.empty());
  EXPECT_TRUE(drive.pipeline().map().take_dirty().empty()) << "the map is untouched";
  const auto after = drive.pipeline().objects();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i)
    EXPECT_EQ(after[i].belief.alpha, before[i].belief.alpha);
  EXPECT_TRUE(drive.process(drive.next_frame(furnished())).accepted);
}

TEST(PipelineNoChange, EmptyFramesAreHarmless) {
  Drive drive;
  drive.watch(furnished(), 25);
  for (int i = 0; i < 20; ++i) {
    Frame frame = drive.next_frame(furnished());
    frame.depth_m.setTo(0.0f);
    EXPECT_TRUE(drive.process(frame).events.empty());
  }
  drive.watch(furnished(), 10);
  expect_nothing_removed_or_moved(drive);
  EXPECT_EQ(drive.pipeline().objects().size(), 2u);
}

TEST(PipelineNoChange, FrameOfTheWrongSizeIsAnError) {
  Drive drive;
  Frame frame = drive.next_frame(furnished());
  frame.camera.width = 100;
  EXPECT_THROW(drive.process(frame), InputError);
  frame = drive.next_frame(furnished());
  frame.depth_m.convertTo(frame.depth_m, CV_16U, 1000.0);
  EXPECT_THROW(drive.process(frame), InputError);
  frame = drive.next_frame(furnished());
  frame.labels.convertTo(frame.labels, CV_8U);
  EXPECT_THROW(drive.process(frame), InputError);
  frame = drive.next_frame(furnished());
  frame.labels = frame.labels.rowRange(0, 10).clone();
  EXPECT_THROW(drive.process(frame), InputError);
  frame = drive.next_frame(furnished());
  frame.color = cv::Mat(3, 3, CV_8UC3);
  EXPECT_THROW(drive.process(frame), InputError);
}

// What a driver sends before it knows its camera; before and after a good frame.
TEST(PipelineNoChange, ImageSmallerThanTheStrideIsAnError) {
  Drive drive;
  Frame tiny;
  tiny.robot = "robot1";
  tiny.camera = {1, 1, 1, 1, 0.5, 0.5};
  tiny.depth_m = cv::Mat(1, 1, CV_32FC1, cv::Scalar(1));
  for (int i = 0; i < 2; ++i) {
    try {
      drive.process(tiny);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_STREQ(error.what(),
                   "robot1: frame 0: image is 1x1, smaller than segmentation.stride = 2");
    }
    drive.watch(furnished(), 1);
  }
}

// A refused frame leaves nothing behind: what follows is as if it had never come.
TEST(PipelineNoChange, FrameThatTheMapCannotTakeChangesNothing) {
  PipelineConfig config = test::room_config();
  config.map.max_depth_m = 30.0;
  Drive with(config), without(config);
  for (int i = 0; i < 12; ++i) {
    Frame frame = with.next_frame(furnished());
    without.next_frame(furnished());
    without.process(frame);
    Frame wide = frame;  // a pyramid with more voxels than are kept track of
    wide.camera.fx = 0.05 * wide.camera.width;
    wide.camera.fy = 0.05 * wide.camera.height;
    Frame far = frame, nowhere = frame;
    far.T_W_C.translation().y() = 2e6;
    nowhere.T_W_C.translation().x() = std::nan("");
    EXPECT_THROW(with.process(wide), InputError);
    EXPECT_THROW(with.process(far), InputError);
    EXPECT_THROW(with.process(nowhere), InputError);
    with.process(frame);
  }
  ASSERT_FALSE(without.events().empty());
  ASSERT_EQ(with.events().size(), without.events().size());
  for (std::size_t i = 0; i < with.events().size(); ++i) {
    const ObjectEvent &left = with.events()[i], &right = without.events()[i];
    EXPECT_EQ(left.sequence, right.sequence);
    EXPECT_EQ(left.kind, right.kind);
    EXPECT_EQ(left.object, right.object);
    EXPECT_EQ(left.evidence.after.alpha, right.evidence.after.alpha);
  }
  MapPublisher with_map(1, config.map), without_map(1, config.map);
  with_map.update(with.pipeline().map());
  without_map.update(without.pipeline().map());
  EXPECT_EQ(with_map.digest().hex(), without_map.digest().hex());
  const auto objects = with.pipeline().objects(), expected = without.pipeline().objects();
  ASSERT_FALSE(expected.empty());
  ASSERT_EQ(objects.size(), expected.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectSnapshot &left = objects[i], &right = expected[i];
    EXPECT_EQ(left.id, right.id);
    EXPECT_EQ(left.box.pose.position_W, right.box.pose.position_W);
    EXPECT_EQ(left.box.pose.yaw_rad, right.box.pose.yaw_rad);
    EXPECT_EQ(left.box.size_m, right.box.size_m);
    EXPECT_EQ(left.centroid_W, right.centroid_W);
    EXPECT_EQ(left.belief.mu, right.belief.mu);
    EXPECT_EQ(left.belief.sigma, right.belief.sigma);
    EXPECT_EQ(left.belief.alpha, right.belief.alpha);
    EXPECT_EQ(left.belief.beta, right.belief.beta);
    EXPECT_EQ(left.observations, right.observations);
    EXPECT_EQ(left.last_seen_ns, right.last_seen_ns);
  }
}

}  // namespace
}  // namespace pocd
