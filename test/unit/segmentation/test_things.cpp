// Things told by geometry alone: frames without masks.
#include <gtest/gtest.h>

#include "pocd/segmentation/things.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::shoot;
using test::solid;

/// The stages from a frame without masks to observations.
test::Segmented things_in(const Scene& scene, const Pose& T_W_C,
                          const PipelineConfig& config = test::room_config()) {
  Frame frame = shoot(scene, T_W_C);
  frame.labels = cv::Mat();
  test::Segmented out;
  ThreadPool pool(1);
  GroundModel ground;
  organize(frame, config.segmentation.stride, config.map.max_depth_m, config.classes,
           ClassTable(config.classes), pool, out.cloud);
  take_for_things(out.cloud);
  segment_planes(out.cloud, config.segmentation, config.depth_noise, out.planes);
  ground.update(out.planes, config.segmentation, config.depth_noise, out.cloud);
  extract_observations(config.segmentation, config.depth_noise, config.map.voxel_size_m, out.planes,
                       out.cloud, out.observations);
  return out;
}

/// A room whose wall is beyond the depth limit of 2.8 m, so that nothing touches it.
PipelineConfig near_config() {
  PipelineConfig config = test::room_config();
  config.map.max_depth_m = 2.8;
  return config;
}

Pose viewpoint() { return test::look_from({0, 0, 1.1}); }

std::int32_t observation_at(const test::Segmented& s, const Eigen::Vector3d& point_W) {
  return s.observations.observation_of[test::pixel_of(s.cloud, point_W)];
}

TEST(Things, AreMovableAndHonestAboutTheirClass) {
  const ClassMap classes = test::room_classes();
  EXPECT_EQ(classes.role(kThing), ClassRole::kObject);
  EXPECT_EQ(classes.stationarity_class(kThing), 0);
  EXPECT_EQ(classes.name(kThing), "thing");
  ClassMap own = classes;
  own.list.push_back({kThing, "void", ClassRole::kIgnore, 1, ""});
  EXPECT_EQ(own.name(kThing), "void") << "a class that is listed goes before";
  EXPECT_EQ(own.role(kThing), ClassRole::kIgnore);
}

TEST(Things, TwoBoxesApartAreTwo) {
  const auto s = things_in(room_with({solid(kBoxClass, {-0.6, 2.0}, {0.5, 0.4, 0.6}),
                                      solid(kBoxClass, {0.6, 2.2}, {0.4, 0.4, 0.8})}),
                           viewpoint(), near_config());
  ASSERT_EQ(s.observations.list.size(), 2u);
  for (const Observation& o : s.observations.list) {
    EXPECT_EQ(o.class_id, kThing);
    EXPECT_EQ(o.instance, 0);
    EXPECT_GT(o.free_beside_share, SegmentationConfig().things.side_share);
  }
}

/// A post before the middle of what is there.
SceneObject post() { return solid(kBoxClass, {0, 1.5}, {0.15, 0.1, 1.0}); }

TEST(Things, ABoxBehindAPostIsOne) {
  const auto s = things_in(room_with({solid(kBoxClass, {0, 2.2}, {1.2, 0.4, 0.6}), post()}),
                           viewpoint(), near_config());
  const std::int32_t left = observation_at(s, {-0.5, 2.0, 0.3});
  ASSERT_NE(left, Observations::kNone);
  EXPECT_EQ(observation_at(s, {0.5, 2.0, 0.3}), left);
  EXPECT_NE(s.observations.list[static_cast<std::size_t>(left)].instance, 0);
  EXPECT_NE(observation_at(s, {0, 1.45, 0.6}), left) << "the post is another thing";
}

TEST(Things, TwoBoxesBehindAPostAreTwoWhenTheirFacesDiffer) {
  // The right one stands 25 cm farther back: no plane of one goes on in the other.
  const auto s = things_in(room_with({solid(kBoxClass, {-0.35, 2.0}, {0.5, 0.4, 0.6}),
                                      solid(kBoxClass, {0.35, 2.25}, {0.5, 0.4, 0.45}), post()}),
                           viewpoint(), near_config());
  const std::int32_t left = observation_at(s, {-0.5, 1.8, 0.3});
  ASSERT_NE(left, Observations::kNone);
  EXPECT_NE(observation_at(s, {0.5, 2.05, 0.3}), left);
}

/// Four walls of 3 cm around a hole.
SceneObject open_box(const Eigen::Vector2d& middle, double width, double depth, double height) {
  SceneObject object = solid(kBoxClass, middle, {width, 0.03, height});
  object.parts.clear();
  const auto wall = [&](double x, double y, double size_x, double size_y) {
    ScenePart part;
    part.size_m = {size_x, size_y, height};
    part.T_O_P.translation() = Eigen::Vector3d(x, y, 0.5 * height);
    object.parts.push_back(part);
  };
  wall(0, -0.5 * depth, width, 0.03);
  wall(0, 0.5 * depth, width, 0.03);
  return object;
}

TEST(Things, NearAndFarWallOfAContainerAreOne) {
  // Seen from above; its ends are missing, so that only the rule makes one thing of the walls.
  const Pose above = test::look_from({0, 0.3, 1.3}, 0.0);
  const auto s = things_in(room_with({open_box({0, 1.9}, 0.8, 0.4, 0.35)}), above, near_config());
  const std::int32_t near = observation_at(s, {0, 1.68, 0.25});
  ASSERT_NE(near, Observations::kNone);
  EXPECT_EQ(observation_at(s, {0, 2.08, 0.3}), near);
}

TEST(Things, TwoWallsOfDifferentHeightAreTwo) {
  const Pose above = test::look_from({0, 0.3, 1.3}, 0.0);
  const auto s = things_in(room_with({solid(kBoxClass, {0, 1.7}, {0.8, 0.03, 0.35}),
                                      solid(kBoxClass, {0, 2.1}, {0.8, 0.03, 0.6})}),
                           above, near_config());
  const std::int32_t near = observation_at(s, {0, 1.68, 0.25});
  ASSERT_NE(near, Observations::kNone);
  EXPECT_NE(observation_at(s, {0, 2.08, 0.5}), near);
}

TEST(Things, OfTwoContainersInARowEachIsOne) {
  // The far wall of the first one stands before the near wall of the second one, as high.
  const Pose above = test::look_from({0, 0.3, 1.5}, 0.0);
  const auto s =
      things_in(room_with({open_box({0, 1.9}, 0.8, 0.3, 0.3), open_box({0, 2.5}, 0.8, 0.3, 0.3)}),
                above, near_config());
  const std::int32_t first = observation_at(s, {0, 1.735, 0.28});
  const std::int32_t second = observation_at(s, {0, 2.635, 0.28});
  ASSERT_NE(first, Observations::kNone);
  ASSERT_NE(second, Observations::kNone);
  EXPECT_NE(first, second);
}

// Masks of classes say what is a box, not how many boxes there are.
TEST(Pieces, WithMasksOfClassesABoxBehindAPostIsOneToo) {
  const PipelineConfig config = near_config();
  const auto pieces = [&](ClassId post_class) {
    GroundModel ground;
    const auto s = test::segment(shoot(room_with({solid(kBoxClass, {0, 2.2}, {1.2, 0.4, 0.6}),
                                                  solid(post_class, {0, 1.5}, {0.15, 0.1, 1.0})}),
                                       viewpoint()),
                                 config, ground);
    return std::make_pair(observation_at(s, {-0.5, 2.0, 0.3}), observation_at(s, {0.5, 2.0, 0.3}));
  };
  for (const ClassId post_class : {test::kCageClass, kBoxClass}) {
    const auto [left, right] = pieces(post_class);
    EXPECT_NE(left, Observations::kNone) << post_class;
    EXPECT_EQ(left, right) << post_class;
  }
}

TEST(Pieces, OfTwoClassesStayTwo) {
  GroundModel ground;
  const auto s = test::segment(
      shoot(room_with({solid(kBoxClass, {-0.35, 2.2}, {0.5, 0.4, 0.6}),
                       solid(test::kCageClass, {0.35, 2.2}, {0.5, 0.4, 0.6}), post()}),
            viewpoint()),
      near_config(), ground);
  EXPECT_NE(observation_at(s, {-0.5, 2.0, 0.3}), observation_at(s, {0.5, 2.0, 0.3}));
}

TEST(Things, AWallThatGoesOnShowsNoSide) {
  const auto s = things_in(room_with({}), viewpoint());
  const std::int32_t wall = observation_at(s, {0, 3.5, 1.1});
  ASSERT_NE(wall, Observations::kNone);
  EXPECT_LT(s.observations.list[static_cast<std::size_t>(wall)].free_beside_share,
            SegmentationConfig().things.side_share);
}

}  // namespace
}  // namespace pocd
