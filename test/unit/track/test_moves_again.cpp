// A move that was told is asked again as more is seen: it is corrected, or taken back.
#include "tracker_rig.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kPersonClass;
using test::room_with;
using test::solid;
using test::TrackerRig;

constexpr double kMinute_s = 60.0;

/// A box in the left half of the room that is carried off; what is found in the right half is half
/// hidden by a screen at first.
class MovesAgain : public ::testing::Test {
 protected:
  void know(const std::vector<SceneObject>& scene) {
    rig_.look_times(20, room_with(scene));
    ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << rig_.told();
    known_ = rig_.of_class(kBoxClass)[0]->id;
  }
  void find(const std::vector<SceneObject>& found, int looks) {
    rig_.look(room_with(found), {}, kMinute_s);
    rig_.look_times(looks, room_with(found));
  }
  ObjectId known() const { return known_; }
  std::vector<const ObjectEvent*> of_kind(EventKind kind) const {
    std::vector<const ObjectEvent*> list;
    for (const ObjectEvent& e : rig_.events) {
      if (e.kind == kind) list.push_back(&e);
    }
    return list;
  }

  TrackerRig rig_;

 private:
  ObjectId known_ = ObjectId::kNone;
};

// Its right half looks like that of the wide one. The left half is not there.
TEST_F(MovesAgain, WhatTurnsOutToBeAnotherThingIsTakenBack) {
  know({solid(kBoxClass, {-0.8, 2.3}, {0.9, 0.3, 0.8})});
  const SceneObject narrow = solid(kBoxClass, {0.6, 2.3}, {0.5, 0.3, 0.8});
  find({narrow, solid(kPersonClass, {0.15, 1.6}, {0.36, 0.05, 1.8})}, 30);
  ASSERT_EQ(of_kind(EventKind::kMoved).size(), 1u) << rig_.told();
  ASSERT_EQ(of_kind(EventKind::kMoved)[0]->object, known());
  const std::size_t told = rig_.events.size();
  rig_.look_times(30, room_with({narrow}));

  ASSERT_EQ(rig_.events.size(), told + 2) << rig_.told();
  const ObjectEvent &gone = rig_.events[told], &added = rig_.events[told + 1];
  EXPECT_EQ(gone.kind, EventKind::kRemoved);
  EXPECT_EQ(gone.object, known());
  EXPECT_EQ(gone.evidence.rule, rule_text(Rule::kAnotherThing));
  EXPECT_NEAR(gone.box.pose.position_W.x(), -0.8, 0.1);
  EXPECT_EQ(added.kind, EventKind::kAdded);
  EXPECT_EQ(added.arrival, Arrival::kArrived);
  EXPECT_NEAR(added.box.pose.position_W.x(), 0.6, 0.1);
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << rig_.told();
  EXPECT_EQ(rig_.of_class(kBoxClass)[0]->id, added.object);
  EXPECT_NE(added.object, known());
  EXPECT_EQ(rig_.published(), rig_.confirmed());
}

// A part of a wide one leaves, and is told to be what is half hidden at first.
TEST_F(MovesAgain, APartThatIsTakenBackIsRetiredAndNotToldAgain) {
  know({solid(kBoxClass, {-0.75, 2.3}, {1.3, 0.3, 0.8})});
  const SceneObject rest = solid(kBoxClass, {-1.22, 2.3}, {0.35, 0.3, 0.8});
  const SceneObject narrow = solid(kBoxClass, {0.6, 2.3}, {0.5, 0.3, 0.8});
  find({rest, narrow, solid(kPersonClass, {0.15, 1.6}, {0.36, 0.05, 1.8})}, 30);
  ASSERT_EQ(of_kind(EventKind::kMoved).size(), 1u) << rig_.told();
  ASSERT_NE(of_kind(EventKind::kMoved)[0]->object, known());
  EXPECT_EQ(rig_.published(), rig_.confirmed()) << rig_.told();
  rig_.look_times(30, room_with({rest, narrow}));
  ASSERT_EQ(rig_.events.back().kind, EventKind::kAdded) << rig_.told();
  EXPECT_EQ(rig_.published(), rig_.confirmed()) << rig_.told();
}

// The known one was wider than what is found, of which nothing more is seen later.
TEST_F(MovesAgain, WhatWasNeverMeasuredThereDoesNotLeave) {
  const SceneObject screen = solid(kPersonClass, {0.0, 1.6}, {0.44, 0.05, 1.8});
  know({solid(kBoxClass, {-0.95, 2.3}, {0.8, 0.3, 0.8}), screen});
  const SceneObject narrow = solid(kBoxClass, {0.6, 2.3}, {0.5, 0.3, 0.8});
  find({narrow, screen}, 30);
  ASSERT_EQ(rig_.count(EventKind::kMoved), 1u) << rig_.told();
  EXPECT_GT(longest_side(rig_.of_class(kBoxClass)[0]->box), 0.7);
  const std::size_t gone = rig_.count(EventKind::kRemoved);
  rig_.look_times(30, room_with({narrow}));
  EXPECT_EQ(rig_.count(EventKind::kRemoved), gone) << rig_.told();
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << rig_.told();
  EXPECT_LT(longest_side(rig_.of_class(kBoxClass)[0]->box), 0.7);
}

// What is seen first fits a thing that was not turned: its right side would be hidden now. It was
// turned, and the side that was its front shows later.
TEST_F(MovesAgain, AMotionIsCorrectedAsMoreIsSeen) {
  const Eigen::Vector3d size(0.8, 0.4, 0.8);
  know({solid(kBoxClass, {-0.8, 2.3}, size)});
  const SceneObject turned = solid(kBoxClass, {0.5, 2.4}, size, M_PI / 2.0);
  find({turned, solid(kPersonClass, {0.12, 1.6}, {0.44, 0.05, 1.8})}, 20);
  ASSERT_EQ(rig_.count(EventKind::kMoved), 1u) << rig_.told();
  ASSERT_EQ(rig_.of_class(kBoxClass)[0]->id, known());
  const auto on_right_side = [&] {
    const auto& surfels = rig_.of_class(kBoxClass)[0]->model.surfels();
    return std::count_if(surfels.begin(), surfels.end(), [](const Surfel& s) {
      return s.point_W.x() > 0.65f && s.point_W.y() > 2.1f && s.point_W.z() < 0.7f;
    });
  };
  EXPECT_GT(on_right_side(), 12);
  rig_.look_times(10, room_with({turned, solid(kPersonClass, {0.21, 1.6}, {0.1, 0.05, 1.8})}));
  rig_.look_times(20, room_with({turned}));
  EXPECT_LT(on_right_side(), 4);
  EXPECT_EQ(rig_.of_class(kBoxClass)[0]->id, known()) << rig_.told();
  EXPECT_EQ(rig_.count(EventKind::kMoved), 1u) << rig_.told();
}

}  // namespace
}  // namespace pocd
