#include "pocd/eval/object_metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pocd/eval/calibration.hpp"
#include "pocd/eval/place_match.hpp"

namespace pocd {
namespace {

OrientedBox stack(double x, double y, double length = 1.5) {
  OrientedBox box;
  box.pose.position_W = {x, y, 1.0};
  box.size_m = {length, 0.5, 2.0};
  return box;
}

/// Visit 0 is frames 0 to 99, visit 1 frames 100 to 199. Things "a" at x = 0, "b" at x = 4.
class ObjectMetrics : public ::testing::Test {
 protected:
  ObjectMetrics() : truth_{{}, ObservedRegion(0.05, 3.0, 0.1), {}, {}, {0, 100, 200}} {
    truth_.objects = {{{"a", 7, 0, stack(0, 0)}, {"b", 7, 0, stack(4, 0)}},
                      {{"a", 7, 0, stack(0, 0)}, {"b", 7, 0, stack(4, 0)}}};
    run_.objects_at_visit_begin.resize(2);
    hold(1, stack(0, 0));
    hold(2, stack(4, 0));
  }
  void hold(std::uint32_t id, const OrientedBox& box) {
    ObjectSnapshot object;
    object.id = ObjectId{id};
    object.box = box;
    run_.objects_at_visit_begin[1].push_back(object);
  }
  void change(ChangeKind kind, std::optional<OrientedBox> before, std::optional<OrientedBox> after,
              std::size_t clear = 120) {
    SeenChange seen{{kind, "x", 7, before, after}, 1, std::nullopt, std::nullopt};
    if (before) seen.old_place_frame = clear;
    if (after) seen.new_place_frame = clear;
    truth_.changes.push_back(seen);
  }
  void event(std::size_t frame, EventKind kind, std::uint32_t id, const OrientedBox& box,
             std::optional<OrientedBox> previous = std::nullopt) {
    ObjectEvent e;
    e.kind = kind;
    e.object = ObjectId{id};
    e.box = box;
    e.previous_box = previous;
    run_.events.push_back({e, frame});
  }
  ObjectScore score() const { return score_objects(run_, truth_); }

  SceneTruth truth_;
  RunEvents run_;
};

TEST_F(ObjectMetrics, ARemovalThatIsReportedCounts) {
  change(ChangeKind::kRemoved, stack(0, 0), std::nullopt);
  event(127, EventKind::kRemoved, 1, stack(0.05, 0.02));
  const ObjectScore s = score();
  EXPECT_DOUBLE_EQ(s.f1(), 1.0);
  EXPECT_EQ(s.delays(), std::vector<double>{7.0});
  EXPECT_EQ(s.false_changes, 0u);
}

TEST_F(ObjectMetrics, AFalseRemovalCostsPrecision) {
  change(ChangeKind::kRemoved, stack(0, 0), std::nullopt);
  event(127, EventKind::kRemoved, 1, stack(0, 0));
  event(130, EventKind::kRemoved, 2, stack(4, 0));
  EXPECT_DOUBLE_EQ(score().precision(), 0.5);
  EXPECT_DOUBLE_EQ(score().recall(), 1.0);
  EXPECT_EQ(score().false_changes, 1u);
}

TEST_F(ObjectMetrics, AMissedChangeCostsRecall) {
  change(ChangeKind::kRemoved, stack(0, 0), std::nullopt);
  change(ChangeKind::kMoved, stack(4, 0), stack(4, 0.6));
  event(127, EventKind::kRemoved, 1, stack(0, 0));
  EXPECT_DOUBLE_EQ(score().precision(), 1.0);
  EXPECT_DOUBLE_EQ(score().recall(), 0.5);
  EXPECT_DOUBLE_EQ(score().recall(ChangeKind::kMoved), 0.0);
}

TEST_F(ObjectMetrics, RemovedAndAddedKnowThePlacesOfAMoveButNotItsKind) {
  change(ChangeKind::kMoved, stack(0, 0), stack(0, 0.7));
  event(127, EventKind::kRemoved, 1, stack(0, 0));
  event(128, EventKind::kAdded, 9, stack(0, 0.7));
  EXPECT_DOUBLE_EQ(score().f1(), 0.0);
  EXPECT_DOUBLE_EQ(score().place_f1(), 1.0);
}

TEST_F(ObjectMetrics, AMoveMustGoTheRightWay) {
  change(ChangeKind::kMoved, stack(0, 0), stack(0, 0.3));
  event(127, EventKind::kMoved, 1, stack(0, -0.3), stack(0, 0));
  EXPECT_DOUBLE_EQ(score().f1(), 0.0);
  run_.events.clear();
  event(127, EventKind::kMoved, 1, stack(0, 0.28), stack(0, 0));
  EXPECT_DOUBLE_EQ(score().f1(), 1.0);
}

TEST_F(ObjectMetrics, RemovalFollowedByTheMoveOfTheSameThingIsTheMove) {
  change(ChangeKind::kMoved, stack(0, 0), stack(0, 0.7));
  event(127, EventKind::kRemoved, 1, stack(0, 0));
  event(131, EventKind::kMoved, 1, stack(0, 0.7), stack(0, 0));
  const ObjectScore s = score();
  EXPECT_DOUBLE_EQ(s.f1(), 1.0);
  EXPECT_EQ(s.delays(), std::vector<double>{11.0});
}

TEST_F(ObjectMetrics, AMoveUnderANewIdSupersedesTheRemoval) {
  change(ChangeKind::kMoved, stack(0, 0), stack(0, 0.7));
  event(127, EventKind::kRemoved, 1, stack(0, 0));
  event(131, EventKind::kMoved, 9, stack(0, 0.7), stack(0, 0));
  EXPECT_DOUBLE_EQ(score().f1(), 1.0);
}

TEST_F(ObjectMetrics, AThingThatComesAndGoesIsFalse) {
  event(127, EventKind::kAdded, 9, stack(2, 3));
  event(140, EventKind::kRemoved, 9, stack(2, 3));
  EXPECT_DOUBLE_EQ(score().precision(), 0.0);
}

TEST_F(ObjectMetrics, DiscoveryIsNoChangeButADuplicateIs) {
  truth_.objects[1].push_back({"c", 7, 0, stack(8, 0)});
  event(127, EventKind::kAdded, 9, stack(8, 0));
  ASSERT_EQ(score().nets.size(), 1u);
  EXPECT_EQ(score().nets[0].second, NetVerdict::kNeutral);
  event(128, EventKind::kAdded, 10, stack(4, 0));  // "b" is held as object 2
  EXPECT_EQ(score().nets[1].second, NetVerdict::kFalse);
}

TEST_F(ObjectMetrics, APartOfAnObjectMayBeRemovedByAnUpdate) {
  // "a" and its neighbour are held as one object 1, 3 m long; the neighbour goes.
  run_.objects_at_visit_begin[1][0].box = stack(0.75, 0, 3.0);
  change(ChangeKind::kRemoved, stack(1.5, 0), std::nullopt);
  event(127, EventKind::kUpdated, 1, stack(0, 0));
  const ObjectScore s = score();
  EXPECT_DOUBLE_EQ(s.recall(), 1.0);
  EXPECT_EQ(s.delays(), std::vector<double>{7.0});
  EXPECT_TRUE(std::isnan(s.precision())) << "an update claims no change of an object";
}

TEST_F(ObjectMetrics, WhatNobodyCouldSeeIsNotAsked) {
  truth_.changes.push_back({{ChangeKind::kRemoved, "x", 7, stack(0, 0), std::nullopt}, 1, {}, {}});
  const ObjectScore s = score();
  EXPECT_TRUE(s.changes.empty());
  EXPECT_EQ(s.unseen_changes, 1u);
}

TEST_F(ObjectMetrics, NothingChangesInTheFirstVisit) {
  event(50, EventKind::kAdded, 1, stack(0, 0));
  event(60, EventKind::kRemoved, 2, stack(4, 0));
  EXPECT_EQ(score().false_changes, 1u);
}

TEST(PlaceMatch, AFaceStandsForItsThing) {
  OrientedBox face = stack(0, -0.26);
  face.size_m.y() = 0.02;
  EXPECT_TRUE(same_place(face, stack(0, 0)));
  EXPECT_FALSE(same_place(face, stack(0, 0.6)));
  OrientedBox hall = stack(0, 0, 20.0);
  hall.size_m.y() = 20.0;
  EXPECT_FALSE(same_place(hall, stack(0, 0)));
}

TEST(Calibration, ErrorIsTheGapBetweenBeliefAndTruth) {
  Calibration calibration;
  for (int i = 0; i < 10; ++i) calibration.add(0.85, i < 8);  // 0.05 off
  for (int i = 0; i < 10; ++i) calibration.add(0.35, i < 6);  // 0.25 off
  EXPECT_NEAR(calibration.expected_error(), 0.15, 1e-12);
  EXPECT_EQ(calibration.bins()[8].count, 10u);
  calibration.add(1.0, true);
  EXPECT_EQ(calibration.bins()[9].count, 1u);
}

TEST(Calibration, APlaceIsHeldUntilItsThingMoves) {
  const std::vector<OrientedBox> first{stack(0, 0), stack(4, 0)},
      second{stack(0, 0.3), stack(4, 0)};
  EXPECT_TRUE(place_is_held(stack(0.05, 0), {first}));
  EXPECT_FALSE(place_is_held(stack(0.05, 0), {first, second}));
  EXPECT_TRUE(place_is_held(stack(0.05, 0.3), {first, second})) << "mapped anew";
  EXPECT_TRUE(place_is_held(stack(4.1, 0), {first, second}));
  EXPECT_FALSE(place_is_held(stack(8, 0), {first}));
}

}  // namespace
}  // namespace pocd
