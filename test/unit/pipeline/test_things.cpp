// A robot that sends no masks: what moves is told, what stands is not.
#include "drive.hpp"

namespace pocd {
namespace {

using test::Drive;
using test::kBoxClass;
using test::room_with;
using test::solid;

void watch(Drive& drive, const Scene& scene, int frames) {
  for (int i = 0; i < frames; ++i) {
    Frame frame = drive.next_frame(scene);
    frame.labels = cv::Mat();
    drive.process(frame);
  }
}

SceneObject left() { return solid(kBoxClass, {-0.6, 2.3}, {0.5, 0.4, 0.6}); }
SceneObject right() { return solid(kBoxClass, {0.6, 2.4}, {0.4, 0.4, 0.8}); }

TEST(PipelineThings, ThingsAreFoundAndTheWallIsNot) {
  Drive drive;
  watch(drive, room_with({left(), right()}), 40);
  const auto objects = drive.pipeline().objects();
  ASSERT_EQ(objects.size(), 2u) << test::text(drive.events());
  for (const ObjectSnapshot& object : objects) EXPECT_EQ(object.class_id, kThing);
  EXPECT_TRUE(drive.of_kind(EventKind::kRemoved).empty());
  EXPECT_TRUE(drive.of_kind(EventKind::kMoved).empty());
}

TEST(PipelineThings, ARemovalAndAnArrivalAreTold) {
  Drive drive;
  watch(drive, room_with({left()}), 30);
  watch(drive, room_with({right()}), 40);
  const auto removed = drive.of_kind(EventKind::kRemoved), moved = drive.of_kind(EventKind::kMoved);
  EXPECT_EQ(removed.size() + moved.size(), 1u);
  EXPECT_FALSE(drive.object_at(-0.6, 2.3));
  EXPECT_TRUE(drive.object_at(0.6, 2.4));
}

TEST(PipelineThings, TheDefaultClassIsStillToBeHad) {
  PipelineConfig config = test::room_config();
  config.classes.without_masks = "default_class";
  config.classes.default_class = test::kWallClass;
  Drive drive(config);
  watch(drive, room_with({left(), right()}), 20);
  EXPECT_TRUE(drive.events().empty());
}

}  // namespace
}  // namespace pocd
