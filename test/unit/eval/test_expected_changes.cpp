#include <gtest/gtest.h>

#include "pocd/eval/expected_changes.hpp"

namespace pocd {
namespace {

ReportedEvent event(EventKind kind, std::uint32_t object, double x, double y) {
  ReportedEvent reported;
  reported.kind = kind;
  reported.object = object;
  reported.class_name = "box";
  reported.position_W = {x, y, 0.0};
  return reported;
}

ReportedEvent moved(std::uint32_t object, double from_x, double x) {
  ReportedEvent reported = event(EventKind::kMoved, object, x, 0.0);
  reported.previous_W = Eigen::Vector3d(from_x, 0.0, 0.0);
  return reported;
}

ExpectedChange expect(EventKind kind, double x, double from_x = 0.0) {
  ExpectedChange change;
  change.kind = kind;
  change.x_m = x;
  change.from_x_m = from_x;
  return change;
}

TEST(ExpectedChanges, EachIsFulfilledByAnEventOfItsOwn) {
  const std::vector<ReportedEvent> events{
      event(EventKind::kAdded, 1, 1.0, 0.0), event(EventKind::kUpdated, 1, 1.0, 0.0),
      event(EventKind::kRemoved, 2, 5.1, 0.0), moved(3, 7.0, 8.0)};
  ExpectedChanges expected;
  expected.changes = {expect(EventKind::kRemoved, 5.0), expect(EventKind::kMoved, 8.2, 7.2),
                      expect(EventKind::kAdded, 1.2)};
  expected.others = OtherReports::kNone;
  EXPECT_TRUE(disappointments(expected, events).empty());
  expected.changes.push_back(expect(EventKind::kRemoved, 5.0));
  EXPECT_EQ(disappointments(expected, events).size(), 1u) << "one event is not two";
}

TEST(ExpectedChanges, PlaceKindAndClassHaveToFit) {
  const std::vector<ReportedEvent> events{moved(3, 7.0, 8.0)};
  ExpectedChanges expected;
  expected.others = OtherReports::kAny;
  expected.changes = {expect(EventKind::kMoved, 8.0, 5.0)};
  EXPECT_EQ(disappointments(expected, events).size(), 1u) << "from elsewhere";
  expected.changes = {expect(EventKind::kMoved, 9.0, 7.0)};
  EXPECT_EQ(disappointments(expected, events).size(), 1u) << "to elsewhere";
  expected.changes = {expect(EventKind::kAdded, 8.0)};
  EXPECT_EQ(disappointments(expected, events).size(), 1u);
  expected.changes = {expect(EventKind::kMoved, 8.0, 7.0)};
  expected.changes[0].class_name = "fence";
  EXPECT_EQ(
      disappointments(expected, events),
      std::vector<std::string>{
          "expected and not reported: MOVED fence (7.00, 0.00) -> (8.00, 0.00) within 0.60 m"});
}

TEST(ExpectedChanges, OthersAreAllowedAsTheFileSays) {
  const std::vector<ReportedEvent> events{event(EventKind::kAdded, 1, 1.0, 0.0),
                                          event(EventKind::kRemoved, 2, 5.0, 0.0)};
  ExpectedChanges expected;
  expected.others = OtherReports::kAny;
  EXPECT_EQ(disappointments(expected, events).size(), 0u);
  expected.others = OtherReports::kAdded;
  EXPECT_EQ(disappointments(expected, events),
            std::vector<std::string>{"reported and not expected: REMOVED box #2 (5.00, 0.00)"});
  expected.others = OtherReports::kNone;
  EXPECT_EQ(disappointments(expected, events).size(), 2u);
}

TEST(ExpectedChanges, WhatAMoveTakesBackIsNotReported) {
  const std::vector<ReportedEvent> events{event(EventKind::kRemoved, 3, 7.0, 0.0),
                                          moved(3, 7.0, 8.0)};
  ExpectedChanges expected;
  expected.others = OtherReports::kNone;
  expected.changes = {expect(EventKind::kMoved, 8.0, 7.0)};
  EXPECT_TRUE(disappointments(expected, events).empty());
}

}  // namespace
}  // namespace pocd
