// What is kept of each object does not grow with what comes and goes beside it.
#include "tracker_rig.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::solid;
using test::TrackerRig;

const SceneObject kStays = solid(kBoxClass, {-0.25, 2.0}, {0.5, 0.4, 0.8});
const SceneObject kComes = solid(kBoxClass, {0.25, 2.0}, {0.5, 0.4, 0.8});

// Boxes beside one that stays, for months: each is told apart from it by masks.
TEST(Bounds, CompanionsAreThoseThatAreThereOrDepartedLately) {
  const auto told_apart = [](test::Segmented& s) { test::cut(s, kBoxClass, 0.0f, 1, 2); };
  TrackerRig rig;
  rig.look_times(6, room_with({}));
  rig.look_times(10, room_with({kStays}), told_apart);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const ObjectId stays = rig.of_class(kBoxClass)[0]->id;
  for (std::size_t round = 1; round <= 5; ++round) {
    rig.look(room_with({kStays}), told_apart, 2.0 * StateConfig().relocation_window_s);
    rig.look_times(10, room_with({kStays, kComes}), told_apart);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
    const LibraryObject& object = *rig.of_class(kBoxClass)[0];
    ASSERT_EQ(object.id, stays);
    ASSERT_EQ(object.companions.size(), 1u) << "in round " << round;
    EXPECT_EQ(object.companions.begin()->second, LibraryObject::kToldApart);
    EXPECT_EQ(object.companions.begin()->first, rig.of_class(kBoxClass)[1]->id);
    rig.look_times(15, room_with({kStays}), told_apart);
    ASSERT_EQ(rig.count(EventKind::kRemoved), round) << rig.told();
  }
}

// A robot with a new name on every run.
TEST(Bounds, RobotsThatSawAThingAreListedUpToANumber) {
  TrackerRig rig;
  const Scene scene = room_with({kStays});
  for (std::size_t n = 0; n < LibraryObject::kMostSeers; ++n) {
    rig.robot = "robot" + std::to_string(1000 + n);
    EXPECT_TRUE(rig.look(scene).warnings.empty());
  }
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const auto& seen_by = rig.of_class(kBoxClass)[0]->seen_by;
  ASSERT_EQ(seen_by.size(), LibraryObject::kMostSeers);
  rig.robot = "one_more";
  const FrameResult result = rig.look(scene);
  EXPECT_EQ(seen_by.size(), LibraryObject::kMostSeers);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("one_more is not listed"), std::string::npos)
      << result.warnings[0];
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->last_robot, "one_more");
  rig.robot = "robot1000";
  EXPECT_TRUE(rig.look(scene).warnings.empty()) << "it is listed";
}

}  // namespace
}  // namespace pocd
