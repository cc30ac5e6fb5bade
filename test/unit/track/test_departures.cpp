#include "pocd/track/departures.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "../../../pocd_core/src/track/motion_starts.hpp"

namespace pocd {
namespace {

constexpr StampNs kSecond = 1'000'000'000;

Departure departed(std::uint32_t id, StampNs departed_ns) {
  Departure d;
  d.id = ObjectId{id};
  d.first_seen_ns = departed_ns - 50 * kSecond;
  d.in_place_ns = departed_ns - kSecond;
  d.departed_ns = departed_ns;
  return d;
}

std::vector<std::uint32_t> ids(const std::deque<Departure>& list) {
  std::vector<std::uint32_t> out;
  for (const Departure& d : list) out.push_back(to_index(d.id));
  return out;
}

TEST(Departures, AreKeptForTheWindowOldestFirst) {
  Departures departures;
  departures.add(departed(3, 100 * kSecond));
  departures.add(departed(1, 130 * kSecond));
  departures.add(departed(2, 150 * kSecond));
  EXPECT_EQ(ids(departures.recent(160 * kSecond, 60.0)), (std::vector<std::uint32_t>{3, 1, 2}))
      << "at the window's end";
  EXPECT_EQ(ids(departures.recent(160 * kSecond + 1, 60.0)), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(ids(departures.recent(100 * kSecond, 60.0)), (std::vector<std::uint32_t>{1, 2}))
      << "what was forgotten does not come back";
  EXPECT_TRUE(departures.recent(1000 * kSecond, 60.0).empty());
}

TEST(Departures, ForgetTakesOutOneId) {
  Departures departures;
  for (const std::uint32_t id : {1u, 2u, 3u}) departures.add(departed(id, 100 * kSecond));
  departures.forget(ObjectId{2});
  departures.forget(ObjectId{77});
  EXPECT_EQ(ids(departures.recent(100 * kSecond, 60.0)), (std::vector<std::uint32_t>{1, 3}));
}

TEST(Departures, HasWhatWasNotForgotten) {
  Departures departures;
  departures.add(departed(1, 100 * kSecond));
  EXPECT_TRUE(departures.has(ObjectId{1}));
  EXPECT_FALSE(departures.has(ObjectId{2}));
  departures.forget(ObjectId{1});
  EXPECT_FALSE(departures.has(ObjectId{1}));
}

TEST(Departures, MovesAreKeptForTheWindowToo) {
  Departures departures;
  Move move;
  for (const std::uint32_t id : {1u, 2u}) {
    move.id = ObjectId{id};
    move.moved_ns = id * 100 * kSecond;
    move.in_place_ns = move.moved_ns - kSecond;
    departures.add_move(move);
  }
  EXPECT_EQ(departures.recent_moves(160 * kSecond, 60.0).size(), 2u);
  ASSERT_EQ(departures.recent_moves(161 * kSecond, 60.0).size(), 1u);
  EXPECT_EQ(departures.recent_moves(161 * kSecond, 60.0).front().id, ObjectId{2});
  departures.set_clock_back(210 * kSecond, 50 * kSecond);
  EXPECT_EQ(departures.recent_moves(100 * kSecond, 60.0).size(), 1u);
  EXPECT_TRUE(departures.recent_moves(101 * kSecond, 60.0).empty()) << "as if it had gone on";
}

TEST(Departures, TheLastMoveOfAThingIsFoundUntilItIsForgotten) {
  Departures departures;
  Move move;
  move.id = ObjectId{7};
  for (const StampNs moved_ns : {1, 2}) {
    move.moved_ns = moved_ns;
    departures.add_move(move);
  }
  move.id = ObjectId{8};
  departures.add_move(move);
  ASSERT_NE(departures.last_move_of(ObjectId{7}), nullptr);
  EXPECT_EQ(departures.last_move_of(ObjectId{7})->moved_ns, 2);
  departures.forget_moves_of(ObjectId{7});
  EXPECT_EQ(departures.last_move_of(ObjectId{7}), nullptr);
  EXPECT_NE(departures.last_move_of(ObjectId{8}), nullptr);
}

TEST(Motion, OfThoseThatExplainTheSameTheShortestIsLikeliest) {
  Motion near, far, partly;
  near.fit = far.fit = partly.fit = 1.0;
  near.seen = far.seen = 0.9;
  near.lengths = partly.lengths = 0.5;
  far.lengths = 1.5;
  partly.seen = 0.2;
  EXPECT_GT(near.likelihood(), far.likelihood());
  EXPECT_GT(far.likelihood(), partly.likelihood()) << "seen as a whole, though farther";
}

TEST(Departures, AClockThatIsSetBackLeavesThemAsOldAsTheyAre) {
  Departures departures;
  departures.add(departed(1, 3590 * kSecond));
  departures.add(departed(2, 3600 * kSecond));
  departures.set_clock_back(3600 * kSecond, 10 * kSecond);
  const auto& kept = departures.recent(60 * kSecond, 60.0);
  EXPECT_EQ(ids(kept), (std::vector<std::uint32_t>{1, 2}));
  for (const Departure& d : kept) {
    EXPECT_LE(d.departed_ns, 10 * kSecond);
    EXPECT_LE(d.in_place_ns, 10 * kSecond);
    EXPECT_LE(d.first_seen_ns, d.in_place_ns);
  }
  EXPECT_EQ(ids(departures.recent(60 * kSecond + 1, 60.0)), (std::vector<std::uint32_t>{2}));
  EXPECT_TRUE(departures.recent(70 * kSecond + 1, 60.0).empty());
}

// A replay of 38 s, again and again: none of its stamps is ever older than the window.
TEST(Departures, AClockThatIsSetBackAgainAndAgainKeepsNothingForEver) {
  Departures departures;
  Move move;
  std::size_t most = 0, most_moves = 0;
  for (std::uint32_t lap = 0; lap < 200; ++lap) {
    for (std::uint32_t second = 0; second < 38; second += 2) {
      departures.add(departed(100 * lap + second, second * kSecond));
      move.moved_ns = second * kSecond;
      departures.add_move(move);
      most = std::max(most, departures.recent(second * kSecond, 60.0).size());
      most_moves = std::max(most_moves, departures.recent_moves(second * kSecond, 60.0).size());
    }
    departures.set_clock_back(37 * kSecond, -1);
  }
  EXPECT_EQ(most, 31u) << "of 60 s, one every other second";
  EXPECT_EQ(most_moves, 31u);
}

TEST(Departures, MoreThanTheMostAreNotKeptWhateverTheStamps) {
  Departures departures;
  Move move;
  for (std::uint32_t i = 1; i <= Departures::kMost; ++i) {
    ASSERT_TRUE(departures.add(departed(i, 5 * kSecond))) << i;
    move.id = ObjectId{i};
    ASSERT_TRUE(departures.add_move(move)) << i;
  }
  EXPECT_FALSE(departures.add(departed(7777, 4 * kSecond)));
  move.id = ObjectId{7777};
  EXPECT_FALSE(departures.add_move(move));
  const auto& kept = departures.recent(5 * kSecond, 60.0);
  EXPECT_EQ(kept.size(), Departures::kMost);
  EXPECT_EQ(kept.front().id, ObjectId{2}) << "the oldest goes";
  EXPECT_EQ(kept.back().id, ObjectId{7777});
  const auto& moves = departures.recent_moves(5 * kSecond, 60.0);
  EXPECT_EQ(moves.size(), Departures::kMost);
  EXPECT_EQ(moves.front().id, ObjectId{2});
}

// Of what was last in place at 99 s and found gone at 100 s, whether something first seen at this
// time, so far from its middle, is another thing.
bool is_another(double first_seen_s, float at_m, double visit_gap_s = 5.0) {
  Departure d = departed(1, 100 * kSecond);
  d.box.size_m = {1.0, 1.0, 1.0};
  LibraryObject found(ObjectId{2}, 0.05);
  found.first_seen_ns = static_cast<StampNs>(first_seen_s * 1e9);
  Surfel surfel;
  surfel.point_W = {at_m, 0.0f, 0.0f};
  surfel.normal_W = {0.0f, 0.0f, 1.0f};
  found.model.add({surfel});
  return were_both_there(d, found, visit_gap_s, 0.05);
}

TEST(Departures, WhatStandsInItsPlaceIsTakenForItForAMomentAndNoLonger) {
  EXPECT_FALSE(is_another(99.5, 2.0f)) << "it came later";
  EXPECT_FALSE(is_another(98.5, 0.4f)) << "it stands partly where the other one was";
  EXPECT_TRUE(is_another(98.5, 0.7f)) << "it stands beside it";
  EXPECT_TRUE(is_another(97.5, 0.4f)) << "both were there for longer than a moment";
  EXPECT_TRUE(is_another(98.5, 0.4f, 0.5)) << "in place on a visit before";
}

}  // namespace
}  // namespace pocd
