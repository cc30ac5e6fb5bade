// By what means a copy that is behind is repaired, and when.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "mirror/catch_up.hpp"

namespace pocd::dds {
namespace {

using std::chrono::milliseconds;
using State = CatchUpPlan::State;

// Somebody hears requests; a reader of replies has its writer as soon as it is there, or never.
constexpr State kAnswered{true, true, true}, kUnheard{true, true, false},
    kAlone{true, false, false};

/// What is wished in each of the turns of 100 ms, without any progress: l listen, a ask, g gather,
/// m listen and gather, b ask and gather, r restart.
// Not inlined: GCC 12 would take its empty optionals for uninitialised values.
[[gnu::noinline]] std::string wishes(CatchUpPlan& plan, const State& state, int turns,
                                     CatchUpPlan::Time& now) {
  std::string text;
  for (int i = 0; i < turns; ++i, now += milliseconds(100)) {
    const auto wish = plan.next(now, state);
    text += wish.restart                 ? 'r'
            : wish.ask && wish.gather    ? 'b'
            : wish.ask                   ? 'a'
            : wish.listen && wish.gather ? 'm'
            : wish.gather                ? 'g'
            : wish.listen                ? 'l'
                                         : '.';
  }
  return text;
}

TEST(CatchUp, OneWhoIsBehindAsksAndReadsTilesWhenStuck) {
  CatchUpPlan plan(CatchUp::kEither);
  CatchUpPlan::Time now{};
  EXPECT_EQ(wishes(plan, kAnswered, 24, now), "...allllllllllllllllmmmb")
      << "again after two seconds";
  // Nobody answers requests.
  CatchUpPlan alone(CatchUp::kEither);
  now = {};
  EXPECT_EQ(wishes(alone, kAlone, 6, now), "...ggg");
}

TEST(CatchUp, AsksWhenTheAnswerCanBeHeard) {
  CatchUpPlan plan(CatchUp::kSnapshot);
  CatchUpPlan::Time now{};
  EXPECT_EQ(wishes(plan, kUnheard, 6, now), "...lll");
  EXPECT_EQ(wishes(plan, kAnswered, 3, now), "lal") << "the publisher hears of the reader later";
}

TEST(CatchUp, OneMeansOnly) {
  CatchUpPlan tiles(CatchUp::kTiles), snapshot(CatchUp::kSnapshot);
  CatchUpPlan::Time now{};
  const std::string by_tiles = wishes(tiles, kAnswered, 70, now);
  EXPECT_EQ(by_tiles.find_first_not_of(".gr"), std::string::npos) << by_tiles;
  EXPECT_EQ(by_tiles.find('r'), 63u) << "what was read in six seconds has led to nothing";
  now = {};
  const std::string by_snapshot = wishes(snapshot, kAnswered, 70, now);
  EXPECT_EQ(by_snapshot.find_first_not_of(".la"), std::string::npos) << by_snapshot;
  EXPECT_EQ(std::count(by_snapshot.begin(), by_snapshot.end(), 'a'), 4);
}

TEST(CatchUp, ProgressIsPatienceAndBeingInStepEndsIt) {
  CatchUpPlan plan(CatchUp::kEither);
  CatchUpPlan::Time now{};
  for (int i = 0; i < 50; ++i) {
    plan.progress(now);
    EXPECT_EQ(wishes(plan, kAnswered, 1, now), ".") << "what comes leads on";
  }
  EXPECT_EQ(wishes(plan, kAnswered, 4, now), "..al");
  EXPECT_EQ(wishes(plan, {false, true, true}, 1, now), ".")
      << "no reader for those who are in step";
  EXPECT_EQ(wishes(plan, kAnswered, 4, now), "...a");
}

}  // namespace
}  // namespace pocd::dds
