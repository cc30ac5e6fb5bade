#include "pocd/eval/state_check.hpp"

#include <gtest/gtest.h>

namespace pocd {
namespace {

ExpectedObject thing(double x, double y, double z) {
  ExpectedObject object;
  object.listed_W = {x, y, z};
  object.box.pose.position_W = {x, y + 0.02, z - 0.05};
  return object;
}

ObjectSnapshot held(std::uint32_t id, double x, double y, double z) {
  ObjectSnapshot object;
  object.id = ObjectId{id};
  object.box.pose.position_W = {x, y, z};
  object.centroid_W = {x, y, z};
  return object;
}

ExpectedState two_things() {
  ExpectedState state;
  state.objects = {thing(0, 0, 0.1), thing(0.3, 0, 0.1)};
  return state;
}

TEST(JudgeState, RightWhenEveryThingIsHeldOnce) {
  const StateVerdict verdict =
      judge_state({held(1, 0.3, 0.03, 0.1), held(2, 0.03, 0, 0.1)}, two_things(), 0.05);
  EXPECT_TRUE(verdict.ok_listed);
  ASSERT_EQ(verdict.matches.size(), 2u);
  EXPECT_EQ(verdict.matches[0].object, ObjectId{2});
  EXPECT_NEAR(verdict.matches[0].listed_m, 0.03, 1e-12);
}

TEST(JudgeState, WrongWhenOneIsMissing) {
  const StateVerdict verdict = judge_state({held(1, 0.3, 0, 0.1)}, two_things(), 0.05);
  EXPECT_FALSE(verdict.ok_listed);
  EXPECT_FALSE(verdict.ok_box);
  EXPECT_EQ(verdict.missing, std::vector<std::size_t>{0});
}

TEST(JudgeState, WrongWhenOneThingIsHeldTwice) {
  const StateVerdict verdict = judge_state(
      {held(1, 0.3, 0, 0.1), held(2, 0, 0, 0.1), held(3, 0.01, 0, 0.1)}, two_things(), 0.05);
  EXPECT_FALSE(verdict.ok_listed);
  EXPECT_EQ(verdict.extra, std::vector<ObjectId>{ObjectId{3}});
}

TEST(JudgeState, WrongWhenACentreIsTooFar) {
  const StateVerdict verdict =
      judge_state({held(1, 0.3, 0, 0.1), held(2, -0.06, 0, 0.1)}, two_things(), 0.05);
  EXPECT_FALSE(verdict.ok_listed);
  EXPECT_TRUE(verdict.missing.empty()) << "it is there, but not in the right place";
}

TEST(JudgeState, CentresOfBoxesAreJudgedApart) {
  // At the centre of the thing's box, 5.4 cm from the centre of its visible surface.
  const StateVerdict verdict =
      judge_state({held(1, 0.3, 0.02, 0.05), held(2, 0, 0.02, 0.05)}, two_things(), 0.05);
  EXPECT_FALSE(verdict.ok_listed);
  EXPECT_TRUE(verdict.ok_box);
}

TEST(JudgeState, AHiddenThingMayBeHeldOrNot) {
  ExpectedState state = two_things();
  state.hidden = {thing(0.6, 0, 0.1)};
  const std::vector<ObjectSnapshot> without = {held(1, 0.3, 0, 0.1), held(2, 0, 0, 0.1)};
  EXPECT_TRUE(judge_state(without, state, 0.05).ok_listed);
  std::vector<ObjectSnapshot> with = without;
  with.push_back(held(7, 0.61, 0, 0.1));
  const StateVerdict verdict = judge_state(with, state, 0.05);
  EXPECT_TRUE(verdict.ok_listed);
  EXPECT_EQ(verdict.kept_hidden, std::vector<ObjectId>{ObjectId{7}});
  with.back() = held(7, 0.66, 0.02, 0.05);
  EXPECT_FALSE(judge_state(with, state, 0.05).ok_listed);
}

TEST(JudgeState, TheCentreSeenWhenLessWasHiddenCounts) {
  ExpectedState state = two_things();
  state.objects[0].earlier_W = {Eigen::Vector3d(0, 0, 0.02)};
  const StateVerdict verdict = judge_state({held(1, 0.3, 0, 0.1), held(2, 0, 0, 0.0)}, state, 0.05);
  EXPECT_TRUE(verdict.ok_listed);
}

}  // namespace
}  // namespace pocd
