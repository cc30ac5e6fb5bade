// What an operator says: forgotten, ignored and removed things, and what is refused.
#include <gtest/gtest.h>

#include "pocd/common/polygon.hpp"
#include "pocd/map/map_delta.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "test_room.hpp"

namespace pocd::test {
namespace {

/// Around (x, y), `half` to each side [m].
Polygon square(double x, double y, double half) {
  return {{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}};
}

OperatorWord word(WordKind kind, const std::string& by = "mira") {
  OperatorWord said;
  said.kind = kind;
  said.by = by;
  return said;
}

class OperatorsWord : public ::testing::Test {
 protected:
  static constexpr double kLeft = -0.8, kRight = 0.8, kRow = 2.2;

  static Scene both() { return room_with({box_at(kLeft), box_at(kRight)}); }
  static SceneObject box_at(double x) { return solid(kBoxClass, {x, kRow}, {0.4, 0.4, 0.5}); }

  std::vector<ObjectEvent> look(const Scene& scene, int frames) {
    std::vector<ObjectEvent> events;
    for (int i = 0; i < frames; ++i) {
      Frame frame = shoot(scene, swaying_camera(next_), next_);
      ++next_;
      const FrameResult result = pipeline_.process_frame(frame);
      EXPECT_TRUE(result.accepted);
      events.insert(events.end(), result.events.begin(), result.events.end());
    }
    publisher_.update(pipeline_.map());
    return events;
  }
  ObjectId object_at(double x) const {
    for (const ObjectSnapshot& object : pipeline_.objects()) {
      if (std::abs(object.box.pose.position_W.x() - x) < 0.2) return object.id;
    }
    return ObjectId::kNone;
  }
  static int kinds(const std::vector<ObjectEvent>& events, EventKind kind) {
    return static_cast<int>(std::count_if(events.begin(), events.end(),
                                          [&](const ObjectEvent& e) { return e.kind == kind; }));
  }
  std::size_t voxels_in(const Polygon& polygon) {
    std::size_t n = 0;
    const double voxel_m = pipeline_.map().config().voxel_size_m;
    for (const BlockKey& key : pipeline_.map().sorted_keys()) {
      const VoxelBlock& block = *pipeline_.map().find(key);
      for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
        const Eigen::Vector2d center(8 * key.x + (i & 7) + 0.5, 8 * key.y + (i >> 3 & 7) + 0.5);
        n += block.weight[i] > 0 && is_inside(polygon, center * voxel_m);
      }
    }
    return n;
  }

  PocdPipeline pipeline_{room_config()};
  MapPublisher publisher_{1, room_config().map};
  std::uint64_t next_ = 0;
};

TEST_F(OperatorsWord, AForgottenObjectIsAddedAnewWhenItIsSeen) {
  const auto before = look(both(), 15);
  ASSERT_EQ(kinds(before, EventKind::kAdded), 2);
  const ObjectId left = object_at(kLeft);
  ASSERT_NE(left, ObjectId::kNone);
  OperatorWord forget = word(WordKind::kForgetObject);
  forget.object = left;
  const WordOutcome outcome = pipeline_.apply(forget);
  ASSERT_TRUE(outcome.done) << outcome.text;
  ASSERT_EQ(outcome.result.events.size(), 2u);
  const ObjectEvent &of_object = outcome.result.events[0], &of_word = outcome.result.events[1];
  EXPECT_EQ(of_object.kind, EventKind::kOperator);
  EXPECT_EQ(of_object.object, left);
  EXPECT_EQ(of_object.by, "mira");
  EXPECT_EQ(of_object.evidence.rule, "forget_object");
  EXPECT_EQ(of_object.sequence, before.back().sequence + 1);
  EXPECT_EQ(of_word.object, ObjectId::kNone);
  EXPECT_EQ(of_word.sequence, before.back().sequence + 2);
  EXPECT_EQ(outcome.result.retired, std::vector<ObjectId>{left});
  EXPECT_EQ(object_at(kLeft), ObjectId::kNone);
  const auto after = look(both(), 15);
  EXPECT_EQ(kinds(after, EventKind::kAdded), 1);
  EXPECT_EQ(kinds(after, EventKind::kRemoved), 0);
  EXPECT_NE(object_at(kLeft), left);
}

TEST_F(OperatorsWord, AForgottenRegionLosesItsObjectsAndItsMap) {
  look(both(), 15);
  const ObjectId right = object_at(kRight);
  OperatorWord forget = word(WordKind::kForgetRegion);
  forget.polygon_W = square(kLeft, kRow, 0.5);
  ASSERT_GT(voxels_in(forget.polygon_W), 0u);
  const std::size_t elsewhere = voxels_in(square(kRight, kRow, 0.5));
  const WordOutcome outcome = pipeline_.apply(forget);
  ASSERT_TRUE(outcome.done) << outcome.text;
  EXPECT_EQ(outcome.result.retired.size(), 1u);
  EXPECT_EQ(voxels_in(forget.polygon_W), 0u);
  EXPECT_EQ(voxels_in(square(kRight, kRow, 0.5)), elsewhere);
  EXPECT_EQ(object_at(kRight), right);
  const MapDigest digest = publisher_.digest();
  publisher_.update(pipeline_.map());
  EXPECT_NE(publisher_.digest(), digest) << "copies of the map hear of it";
}

TEST_F(OperatorsWord, ResetLeavesNothingButNumbersAndIgnoredRegions) {
  const auto before = look(both(), 15);
  OperatorWord ignore = word(WordKind::kIgnoreRegion);
  ignore.region = "dock";
  ignore.polygon_W = square(50, 50, 1);
  ASSERT_TRUE(pipeline_.apply(ignore).done);
  const ObjectId left = object_at(kLeft);
  const WordOutcome outcome = pipeline_.apply(word(WordKind::kReset));
  ASSERT_TRUE(outcome.done) << outcome.text;
  EXPECT_EQ(outcome.result.retired.size(), 2u);
  EXPECT_TRUE(pipeline_.objects().empty());
  EXPECT_EQ(pipeline_.map().block_count(), 0u);
  publisher_.update(pipeline_.map());
  EXPECT_TRUE(publisher_.tiles().empty());
  OperatorWord heed = word(WordKind::kHeedRegion);
  heed.region = "dock";
  EXPECT_TRUE(pipeline_.apply(heed).done) << "it is ignored still";
  const auto after = look(both(), 15);
  EXPECT_EQ(kinds(after, EventKind::kAdded), 2);
  EXPECT_GT(after.front().sequence, before.back().sequence);
  EXPECT_GT(to_index(object_at(kLeft)), to_index(left));
  EXPECT_GT(pipeline_.map().block_count(), 0u);
}

TEST_F(OperatorsWord, WhatIsInAnIgnoredRegionStaysAsItWas) {
  look(both(), 15);
  const ObjectId left = object_at(kLeft);
  OperatorWord ignore = word(WordKind::kIgnoreRegion);
  ignore.region = "dock";
  ignore.polygon_W = square(kLeft, kRow, 0.6);
  const WordOutcome outcome = pipeline_.apply(ignore);
  ASSERT_TRUE(outcome.done) << outcome.text;
  EXPECT_EQ(outcome.result.events.back().evidence.rule, "ignore_region dock");
  const std::size_t voxels = voxels_in(square(kLeft, kRow, 0.5));
  // It is carried off, another one comes beside it, and the other box goes, too.
  const Scene later = room_with({solid(kBoxClass, {kLeft + 0.3, kRow - 0.3}, {0.3, 0.3, 0.4})});
  const auto events = look(later, 40);
  EXPECT_EQ(kinds(events, EventKind::kAdded), 0);
  EXPECT_EQ(kinds(events, EventKind::kRemoved), 1) << "of what is not in the region";
  EXPECT_EQ(object_at(kLeft), left);
  EXPECT_EQ(object_at(kRight), ObjectId::kNone);
  EXPECT_EQ(voxels_in(square(kLeft, kRow, 0.5)), voxels);
  OperatorWord heed = word(WordKind::kHeedRegion);
  heed.region = "dock";
  ASSERT_TRUE(pipeline_.apply(heed).done);
  const auto heeded = look(later, 40);
  EXPECT_GT(kinds(heeded, EventKind::kRemoved) + kinds(heeded, EventKind::kMoved), 0);
  EXPECT_NE(object_at(kLeft), left);
}

TEST_F(OperatorsWord, AConfirmedRemovalIsAnEventWithWhoSaidIt) {
  look(both(), 15);
  OperatorWord confirm = word(WordKind::kConfirmRemoval, "sam");
  confirm.object = object_at(kLeft);
  const WordOutcome outcome = pipeline_.apply(confirm);
  ASSERT_TRUE(outcome.done) << outcome.text;
  const ObjectEvent& removed = outcome.result.events.front();
  EXPECT_EQ(removed.kind, EventKind::kRemoved);
  EXPECT_EQ(removed.by, "sam");
  EXPECT_EQ(removed.evidence.rule, "confirm_removal");
  EXPECT_GT(removed.last_there_ns, 0);
  EXPECT_EQ(object_at(kLeft), ObjectId::kNone);
  EXPECT_NE(object_at(kRight), ObjectId::kNone);
}

TEST_F(OperatorsWord, ARemovalSaysBetweenWhichLooksItHappened) {
  look(both(), 15);
  const StampNs last_there = shoot(both(), swaying_camera(0), next_ - 1).stamp_ns;
  const StampNs first_gone = shoot(both(), swaying_camera(0), next_).stamp_ns;
  const auto events = look(room_with({box_at(kRight)}), 40);
  ASSERT_EQ(kinds(events, EventKind::kRemoved), 1);
  for (const ObjectEvent& event : events) {
    if (event.kind != EventKind::kRemoved) continue;
    EXPECT_EQ(event.last_there_ns, last_there);
    EXPECT_EQ(event.first_gone_ns, first_gone);
    EXPECT_GE(event.stamp_ns, event.first_gone_ns);
    EXPECT_EQ(event.by, "");
  }
}

TEST_F(OperatorsWord, ThatCannotBeFollowedChangesNothing) {
  look(both(), 15);
  const MapDigest digest = publisher_.digest();
  const auto refused = [&](const OperatorWord& said, const std::string& why) {
    const WordOutcome outcome = pipeline_.apply(said);
    EXPECT_FALSE(outcome.done);
    EXPECT_TRUE(outcome.result.events.empty());
    EXPECT_NE(outcome.text.find(why), std::string::npos) << outcome.text;
  };
  refused(word(WordKind::kReset, ""), "by is empty");
  refused(word(WordKind::kReset, std::string(201, 'x')), "by has 201 bytes");
  refused(word(WordKind::kReset, "a\nb"), "control characters");
  OperatorWord object = word(WordKind::kForgetObject);
  object.object = static_cast<ObjectId>(4711);
  refused(object, "object 4711 is not known");
  OperatorWord region = word(WordKind::kForgetRegion);
  region.polygon_W = {{0, 0}, {1, 1}};
  refused(region, "polygon has 2 corners");
  region.polygon_W = {{0, 0}, {1, 1}, {std::nan(""), 0}};
  refused(region, "no place in the map");
  region.kind = WordKind::kIgnoreRegion;
  region.polygon_W = square(0, 0, 1);
  refused(region, "region is empty");
  region.kind = WordKind::kHeedRegion;
  region.region = "dock";
  refused(region, "\"dock\" is not ignored");
  publisher_.update(pipeline_.map());
  EXPECT_EQ(publisher_.digest(), digest);
  EXPECT_EQ(pipeline_.objects().size(), 2u);
}

TEST(PolygonOnTheGround, InsideAndThrough) {
  const Polygon u{{0, 0}, {4, 0}, {4, 4}, {3, 4}, {3, 1}, {1, 1}, {1, 4}, {0, 4}};
  EXPECT_TRUE(is_inside(u, {0.5, 3}));
  EXPECT_TRUE(is_inside(u, {2, 0.5}));
  EXPECT_FALSE(is_inside(u, {2, 2}));
  EXPECT_FALSE(is_inside(u, {5, 2}));
  EXPECT_TRUE(passes_through(u, {-1, 2}, {5, 2}));
  EXPECT_FALSE(passes_through(u, {1.5, 2}, {2.5, 3}));
  EXPECT_FALSE(passes_through(u, {2, 5}, {2, 1.5}));
  EXPECT_TRUE(passes_through(u, {2, 5}, {2, 0.5}));
}

}  // namespace
}  // namespace pocd::test
