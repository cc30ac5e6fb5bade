// By what means a copy that is behind is repaired, and when.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "mirror/catch_up.hpp"

namespace pocd::dds {
namespace {

using std::chrono::milliseconds;
using State = CatchUpPlan::State;

constexpr State kNothing{true, false, true}, kLacksAStep{true, true, true};

/// What is wished in each of the turns of 100 ms, without any progress: g gather, r restart, a ask.
// Not inlined: GCC 12 would take its empty optionals for uninitialised values.
[[gnu::noinline]] std::string wishes(CatchUpPlan& plan, const State& state, int turns,
                                     CatchUpPlan::Time& now) {
  std::string text;
  for (int i = 0; i < turns; ++i, now += milliseconds(100)) {
    const auto wish = plan.next(now, state);
    text += wish.restart              ? 'r'
            : wish.ask && wish.gather ? 'b'
            : wish.ask                ? 'a'
            : wish.gather             ? 'g'
                                      : '.';
  }
  return text;
}

TEST(CatchUp, OneWhoHasNothingReadsTilesAndAsksWhenStuck) {
  CatchUpPlan plan(CatchUp::kEither);
  CatchUpPlan::Time now{};
  EXPECT_EQ(wishes(plan, kNothing, 22, now), "...gggggggggggggggggbg");
}

TEST(CatchUp, OneWhoLacksAStepAsksAndReadsTilesWhenStuck) {
  CatchUpPlan plan(CatchUp::kEither);
  CatchUpPlan::Time now{};
  EXPECT_EQ(wishes(plan, kLacksAStep, 22, now), "...a................gg");
  EXPECT_EQ(wishes(plan, kLacksAStep, 2, now), "gb") << "asked again after two seconds";
  // Nobody answers requests: tiles, from the beginning.
  CatchUpPlan other(CatchUp::kEither);
  now = {};
  EXPECT_EQ(wishes(other, {true, true, false}, 5, now), "...gg");
}

TEST(CatchUp, OneMeansOnly) {
  CatchUpPlan tiles(CatchUp::kTiles), snapshot(CatchUp::kSnapshot);
  CatchUpPlan::Time now{};
  const std::string by_tiles = wishes(tiles, kLacksAStep, 70, now);
  EXPECT_EQ(by_tiles.find('a'), std::string::npos);
  EXPECT_EQ(by_tiles.find('r'), 63u) << "what was read in six seconds has led to nothing";
  now = {};
  const std::string by_snapshot = wishes(snapshot, kNothing, 70, now);
  EXPECT_EQ(by_snapshot.find_first_not_of(".a"), std::string::npos);
  EXPECT_EQ(std::count(by_snapshot.begin(), by_snapshot.end(), 'a'), 4);
}

TEST(CatchUp, ProgressIsPatienceAndBeingInStepEndsIt) {
  CatchUpPlan plan(CatchUp::kEither);
  CatchUpPlan::Time now{};
  for (int i = 0; i < 50; ++i) {
    plan.progress(now);
    EXPECT_EQ(wishes(plan, kLacksAStep, 1, now), ".") << "what comes leads on";
  }
  EXPECT_EQ(wishes(plan, kLacksAStep, 4, now), "..a.");
  EXPECT_EQ(wishes(plan, {false, true, true}, 1, now), ".");
  EXPECT_EQ(wishes(plan, kLacksAStep, 4, now), "...a");
}

}  // namespace
}  // namespace pocd::dds
