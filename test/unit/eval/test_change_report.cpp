#include <gtest/gtest.h>

#include "pocd/eval/change_report.hpp"
#include "pocd/sim/scenario_yaml.hpp"

namespace pocd {
namespace {

/// The demonstration's scenario, and the events of a system that makes no mistake about it.
class ChangeReportTest : public testing::Test {
 protected:
  ChangeReportTest()
      : scenario_(load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/demo.yaml")) {
    for (const TruthObject& object : objects_after(scenario_, 0))
      add(EventKind::kAdded, object.box);
    for (std::size_t visit = 1; visit < scenario_.visits.size(); ++visit) {
      for (const TruthChange& change : changes_of(scenario_, visit)) {
        switch (change.kind) {
          case ChangeKind::kAdded:
            add(EventKind::kAdded, *change.after);
            break;
          case ChangeKind::kRemoved:
            add(EventKind::kRemoved, *change.before);
            break;
          case ChangeKind::kMoved:
            add(EventKind::kMoved, *change.after);
            events_.back().previous_W = change.before->pose.position_W;
            moved_ = events_.size() - 1;
            break;
        }
      }
    }
  }
  void add(EventKind kind, const OrientedBox& box) {
    ReportedEvent event;
    event.kind = kind;
    event.object = static_cast<std::uint32_t>(events_.size() + 1);
    event.position_W = box.pose.position_W;
    events_.push_back(event);
  }
  ChangeReport compare() const { return compare_changes(scenario_, events_, 0.3); }

  Scenario scenario_;
  std::vector<ReportedEvent> events_;
  std::size_t moved_ = 0;
};

TEST_F(ChangeReportTest, AllRight) {
  const ChangeReport report = compare();
  EXPECT_EQ(report.rows.size(), events_.size());
  EXPECT_GE(report.changes, 5u);
  EXPECT_EQ(report.right_changes, report.changes);
  EXPECT_TRUE(report.false_reports.empty());
  EXPECT_EQ(format_report(report).find("--"), std::string::npos);
}

TEST_F(ChangeReportTest, MissedChangeIsNothing) {
  events_.pop_back();
  const ChangeReport report = compare();
  EXPECT_EQ(report.right_changes, report.changes - 1);
  EXPECT_TRUE(report.false_reports.empty());
  EXPECT_NE(format_report(report).find("nothing"), std::string::npos);
}

TEST_F(ChangeReportTest, EventFarFromTheTruthIsWrongTwice) {
  events_[moved_].position_W.x() = events_[moved_].previous_W->x() + 9.0;
  const ChangeReport report = compare();
  EXPECT_EQ(report.right_changes, report.changes - 1);
  EXPECT_EQ(report.false_reports.size(), 1u);
}

TEST_F(ChangeReportTest, RadiusIsTheLimit) {
  const double y = events_[moved_].position_W.y();
  events_[moved_].position_W.y() = y + 0.299;
  EXPECT_EQ(compare().right_changes, compare().changes);
  events_[moved_].position_W.y() = y + 0.301;
  EXPECT_EQ(compare().right_changes, compare().changes - 1);
}

TEST_F(ChangeReportTest, EventOfAnotherKindNearByIsShownButNotRight) {
  for (ReportedEvent& event : events_) {
    if (event.kind != EventKind::kRemoved) continue;
    event.kind = EventKind::kMoved;
    break;
  }
  const ChangeReport report = compare();
  EXPECT_EQ(report.right_changes, report.changes - 1);
  EXPECT_TRUE(report.false_reports.empty());
}

TEST_F(ChangeReportTest, InventedEventIsFalseAndUpdatesAreNot) {
  OrientedBox nowhere;
  nowhere.pose.position_W = {0, 0, 50};
  nowhere.pose.position_W.x() = 100;
  add(EventKind::kRemoved, nowhere);
  add(EventKind::kUpdated, nowhere);
  const ChangeReport report = compare();
  EXPECT_EQ(report.right_changes, report.changes);
  ASSERT_EQ(report.false_reports.size(), 1u);
  EXPECT_NE(report.false_reports[0].find("REMOVED"), std::string::npos);
}

TEST_F(ChangeReportTest, MoveAsRemovedAndAddedIsShownButNotRight) {
  const ReportedEvent move = events_[moved_];
  events_.erase(events_.begin() + static_cast<std::ptrdiff_t>(moved_));
  OrientedBox before, after;
  before.pose.position_W = *move.previous_W;
  after.pose.position_W = move.position_W;
  add(EventKind::kRemoved, before);
  add(EventKind::kAdded, after);
  const ChangeReport report = compare();
  EXPECT_EQ(report.right_changes, report.changes - 1);
  EXPECT_TRUE(report.false_reports.empty());
  EXPECT_NE(format_report(report).find(", ADDED"), std::string::npos);
}

}  // namespace
}  // namespace pocd
