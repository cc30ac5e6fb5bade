#include <gtest/gtest.h>

#include "pocd/segmentation/planes.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kFloorClass;
using test::kWallClass;

/// Runs the stages up to the ground on a frame.
OrganizedCloud grounded(const Frame& frame, const PipelineConfig& config, GroundModel& ground) {
  ThreadPool pool(1);
  OrganizedCloud cloud;
  PlaneSegmentation planes;
  organize(frame, config.segmentation.stride, config.map.max_depth_m, config.classes,
           ClassTable(config.classes), pool, cloud);
  segment_planes(cloud, config.segmentation, config.depth_noise, planes);
  vote_planes(planes, config.segmentation.majority_share, cloud);
  ground.update(planes, config.segmentation, config.depth_noise, cloud);
  return cloud;
}

Scene with_table() { return test::room_with({test::solid(kBoxClass, {0, 2.0}, {1.2, 0.8, 0.7})}); }

/// So near above the table that its top and the wall fill the picture.
Pose over_the_table() { return test::look_from({0, 1.3, 1.2}, 0.0, 0.75); }
Pose overview() { return test::look_from({0, -0.4, 1.4}, 0.0, 0.35); }

TEST(Ground, IsThePlaneOfItsClassNotALowerOne) {
  // A platform of floor class at 30 cm, seen with bare (background) ground around it.
  const PipelineConfig config = test::room_config();
  Scene scene = test::room_with({test::solid(kFloorClass, {0, 2.2}, {2.0, 1.4, 0.3})});
  scene.objects.front().class_id = kWallClass;
  GroundModel ground;
  grounded(test::shoot(scene, test::look_from({0, -0.2, 1.6}, 0.0, 0.45)), config, ground);
  ASSERT_TRUE(ground.known());
  EXPECT_NEAR(ground.height_at(0, 2), 0.3f, 0.01f);
}

TEST(Ground, WithoutClassesItIsTheLowestLargePlaneThatFacesUp) {
  PipelineConfig config = test::room_config();
  config.classes.default_class = kBoxClass;
  Frame frame = test::shoot(with_table(), overview());
  frame.labels = cv::Mat();
  GroundModel ground;
  const OrganizedCloud cloud = grounded(frame, config, ground);
  ASSERT_TRUE(ground.known());
  EXPECT_NEAR(ground.height_at(0, 2), 0.0f, 0.01f);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.9, 2.2, 0.0})], PixelKind::kGround);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.0, 2.0, 0.7})], PixelKind::kObject);
}

TEST(Ground, TableTopDoesNotReplaceAKnownFloor) {
  PipelineConfig config = test::room_config();
  config.classes.default_class = kBoxClass;
  GroundModel ground;
  Frame first = test::shoot(with_table(), overview());
  first.labels = cv::Mat();
  grounded(first, config, ground);
  Frame second = test::shoot(with_table(), over_the_table(), 1);
  second.labels = cv::Mat();
  const OrganizedCloud cloud = grounded(second, config, ground);
  EXPECT_NEAR(ground.height_at(0, 2), 0.0f, 0.01f);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.0, 2.0, 0.7})], PixelKind::kObject);
  // The same picture without the one before takes the table for the floor: it could not know.
  GroundModel alone;
  grounded(second, config, alone);
  ASSERT_TRUE(alone.known());
  EXPECT_NEAR(alone.height_at(0, 2), 0.7f, 0.01f);
}

TEST(Ground, LowerPlaneReplacesOneTakenByMistake) {
  PipelineConfig config = test::room_config();
  config.classes.default_class = kBoxClass;
  GroundModel ground;
  for (const auto& [pose, height_m] :
       {std::pair{over_the_table(), 0.7f}, std::pair{overview(), 0.0f}}) {
    Frame frame = test::shoot(with_table(), pose);
    frame.labels = cv::Mat();
    grounded(frame, config, ground);
    EXPECT_NEAR(ground.height_at(0, 2), height_m, 0.01f);
  }
}

TEST(Ground, ClassOutweighsLooksFoundBefore) {
  const PipelineConfig config = test::room_config();
  GroundModel ground;
  Frame unlabelled = test::shoot(with_table(), over_the_table());
  unlabelled.labels.setTo(kBoxClass);
  grounded(unlabelled, config, ground);
  ASSERT_NEAR(ground.height_at(0, 2), 0.7f, 0.01f);
  grounded(test::shoot(with_table(), overview(), 1), config, ground);
  EXPECT_NEAR(ground.height_at(0, 2), 0.0f, 0.01f);
}

TEST(Ground, BandAndBelowAreGroundWhateverTheirClass) {
  // A sheet of 3 cm on the floor is no object; a carton of 20 cm is one above the band.
  const PipelineConfig config = test::room_config();
  const Scene scene = test::room_with({test::solid(kBoxClass, {-0.5, 2.0}, {0.6, 0.6, 0.03}),
                                       test::solid(kBoxClass, {0.5, 2.0}, {0.5, 0.5, 0.2})});
  GroundModel ground;
  const OrganizedCloud cloud = grounded(test::shoot(scene, overview()), config, ground);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {-0.5, 2.0, 0.03})], PixelKind::kGround);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.5, 2.0, 0.2})], PixelKind::kObject);
}

TEST(Ground, GroundClassHighUpIsBackgroundAndSoIsWhatIsTooHigh) {
  PipelineConfig config = test::room_config();
  config.segmentation.max_height_m = 0.8;
  const Scene scene = test::room_with({test::solid(kFloorClass, {-0.6, 2.5}, {0.5, 0.3, 0.6}),
                                       test::solid(kBoxClass, {0.6, 2.5}, {0.5, 0.3, 1.2})});
  GroundModel ground;
  const OrganizedCloud cloud = grounded(test::shoot(scene, overview()), config, ground);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {-0.6, 2.35, 0.4})], PixelKind::kBackground);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.6, 2.35, 0.5})], PixelKind::kObject);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.6, 2.35, 1.0})], PixelKind::kBackground);
}

TEST(Ground, UnknownGroundLeavesKindsAlone) {
  const PipelineConfig config = test::room_config();
  GroundModel ground;
  const OrganizedCloud cloud = grounded(
      test::shoot(test::room_with({}), test::look_from({0, 1.5, 2.0}, 0.0, -0.2)), config, ground);
  EXPECT_FALSE(ground.known());
  for (const PixelKind kind : cloud.kind) EXPECT_NE(kind, PixelKind::kGround);
}

TEST(Ground, DynamicPixelsOfTheBandStayDynamic) {
  const PipelineConfig config = test::room_config();
  const Scene scene =
      test::room_with({test::solid(test::kPersonClass, {0, 2.0}, {0.6, 0.6, 0.04})});
  GroundModel ground;
  const OrganizedCloud cloud = grounded(test::shoot(scene, overview()), config, ground);
  EXPECT_EQ(cloud.kind[test::pixel_of(cloud, {0.0, 2.0, 0.04})], PixelKind::kDynamic);
}

/// A plane through the origin that is tilted about y, of so many pixels.
PlaneSegmentation tilted_plane(const OrganizedCloud& cloud, int pixels) {
  PlaneSegmentation planes;
  planes.plane_of.assign(cloud.size(), PlaneSegmentation::kNoPlane);
  planes.planes.push_back({{-0.08f, 0.0f, 0.9968f}, 0.0f, {0.0f, 0.0f, 0.0f}, pixels});
  return planes;
}

TEST(Ground, AStripHoldsItsTiltForItsOwnFrameOnly) {
  const PipelineConfig config = test::room_config();
  GroundModel unused;
  OrganizedCloud cloud = grounded(test::shoot(with_table(), overview()), config, unused);
  const int least =
      static_cast<int>(config.segmentation.ground_min_share * static_cast<double>(cloud.size()));
  PlaneSegmentation none;
  none.plane_of.assign(cloud.size(), PlaneSegmentation::kNoPlane);
  for (const bool strip : {true, false}) {
    GroundModel ground;
    ground.update(tilted_plane(cloud, (strip ? 2 : 20) * least), config.segmentation,
                  config.depth_noise, cloud);
    EXPECT_NEAR(ground.height_at(4, 0), 0.32f, 0.01f);
    ground.update(none, config.segmentation, config.depth_noise, cloud);
    EXPECT_NEAR(ground.height_at(4, 0), strip ? 0.0f : 0.32f, 0.01f);
  }
}

TEST(Ground, PixelsOfItsClassGiveTheLevelUntilThereIsAPlane) {
  const PipelineConfig config = test::room_config();
  GroundModel unused;
  OrganizedCloud cloud = grounded(test::shoot(with_table(), overview()), config, unused);
  PlaneSegmentation none;
  none.plane_of.assign(cloud.size(), PlaneSegmentation::kNoPlane);
  GroundModel ground;
  ground.update(none, config.segmentation, config.depth_noise, cloud);
  ASSERT_TRUE(ground.known());
  EXPECT_NEAR(ground.height_at(4, 0), 0.0f, 0.01f);
}

}  // namespace
}  // namespace pocd
