// A robot that sends no masks: what moves is told, what stands is not.
#include <map>

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
  config.classes.without_masks = WithoutMasks::kDefaultClass;
  config.classes.default_class = test::kWallClass;
  Drive drive(config);
  watch(drive, room_with({left(), right()}), 20);
  EXPECT_TRUE(drive.events().empty());
}

/// A robot whose network fails for good: masks for a while, then a frame per second without.
class MasksEnd : public ::testing::Test {
 protected:
  void know(Drive& drive) {
    drive.watch(room_with({left()}), 30);
    ASSERT_EQ(drive.pipeline().objects().size(), 1u) << test::text(drive.events());
    now_ns_ = 1'000'000'000 + 30 * 66'666'667LL;
  }
  /// Warnings by their texts.
  std::map<std::string, int> without_masks(Drive& drive, const Scene& scene, int frames) {
    std::map<std::string, int> warnings;
    for (int i = 0; i < frames; ++i) {
      Frame frame = drive.next_frame(scene);
      frame.labels = cv::Mat();
      frame.stamp_ns = now_ns_ += 1'000'000'000;
      for (const std::string& warning : drive.process(frame).warnings) ++warnings[warning];
    }
    return warnings;
  }

  static constexpr const char* kNothingIsMapped =
      "no segmentation image: nothing is added, matched or mapped";
  StampNs now_ns_ = 0;
};

TEST_F(MasksEnd, ItGoesOnWithThingsByGeometryAndSaysSo) {
  Drive drive;
  know(drive);
  const ObjectId box = drive.pipeline().objects()[0].id;
  EXPECT_EQ(without_masks(drive, room_with({left()}), 30),
            (std::map<std::string, int>{{kNothingIsMapped, 30}}));
  EXPECT_EQ(without_masks(drive, room_with({left()}), 20),
            (std::map<std::string, int>{
                {"no segmentation image for 30 s: goes on without, with things by geometry", 1}}));
  EXPECT_EQ(drive.events().size(), 1u) << test::text(drive.events());
  without_masks(drive, room_with({left(), right()}), 30);
  ASSERT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << test::text(drive.events());
  EXPECT_EQ(drive.of_kind(EventKind::kAdded)[1].class_id, kThing);
  EXPECT_EQ(drive.of_kind(EventKind::kAdded)[1].arrival, Arrival::kArrived);
  const auto known = drive.object_at(-0.6, 2.3);
  ASSERT_TRUE(known);
  EXPECT_EQ(known->id, box) << "what masks told is known as before";
  EXPECT_EQ(known->class_id, kBoxClass);
  EXPECT_GT(drive.voxels_of(box), 100u) << "and keeps its surface";
  without_masks(drive, room_with({right()}), 20);
  ASSERT_EQ(drive.of_kind(EventKind::kRemoved).size(), 1u) << test::text(drive.events());
  EXPECT_EQ(drive.of_kind(EventKind::kRemoved)[0].object, box);
  // When masks are back, a frame without is one that lost its mask again.
  Frame frame = drive.next_frame(room_with({right()}));
  frame.stamp_ns = now_ns_ += 1'000'000'000;
  EXPECT_TRUE(drive.process(frame).warnings.empty());
  EXPECT_EQ(without_masks(drive, room_with({right()}), 1).count(kNothingIsMapped), 1u);
}

TEST_F(MasksEnd, ItMapsTheConfiguredClassAndSaysSo) {
  PipelineConfig config = test::room_config();
  config.classes.without_masks = WithoutMasks::kDefaultClass;
  config.classes.default_class = test::kWallClass;
  Drive drive(config);
  know(drive);
  without_masks(drive, room_with({left()}), 30);
  EXPECT_EQ(
      without_masks(drive, room_with({left(), right()}), 20),
      (std::map<std::string, int>{
          {"no segmentation image for 30 s: goes on without, all pixels are of class wall", 1}}));
  EXPECT_EQ(drive.events().size(), 1u) << test::text(drive.events());
  EXPECT_GT(drive.solid_voxels_in({0.4, 2.1, 0.1}, {0.8, 2.4, 0.9}), 50u) << "it is mapped";
}

}  // namespace
}  // namespace pocd
