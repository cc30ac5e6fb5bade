#include "view/history.hpp"

#include <gtest/gtest.h>

#include "view/newest_log.hpp"

namespace pocd::view::testing {
namespace {

constexpr StampNs kSecond = 1000000000;

WatchedObject object(double x, double alpha, StampNs seen_ns, StampNs first_ns = 0) {
  WatchedObject object;
  object.class_name = "box";
  object.state.id = ObjectId{3};
  object.state.box.pose.position_W.x() = x;
  object.state.box.size_m = {1, 1, 1};
  object.state.belief.alpha = alpha;
  object.state.belief.beta = 1.0;
  object.state.first_seen_ns = first_ns;
  object.state.last_seen_ns = seen_ns;
  return object;
}

TEST(History, SaysWhereAnObjectWas) {
  History history;
  history.state("a", object(1, 1, 10 * kSecond, 5 * kSecond), 1, 10 * kSecond);
  history.state("a", object(2, 1, 20 * kSecond, 5 * kSecond), 1, 20 * kSecond);
  history.gone("a", 30 * kSecond);
  EXPECT_TRUE(history.at(4 * kSecond).empty());
  const auto x = [&](StampNs at) { return history.at(at).at(0).second.box.pose.position_W.x(); };
  EXPECT_EQ(x(5 * kSecond), 1);  // seen before it was heard of
  EXPECT_EQ(x(19 * kSecond), 1);
  EXPECT_EQ(x(20 * kSecond), 2);
  EXPECT_EQ(x(30 * kSecond - 1), 2);
  EXPECT_TRUE(history.at(30 * kSecond).empty());
}

TEST(History, ABeliefThatFallsUnseenHasTheTimeOfWhatWasHeard) {
  History history;
  history.state("a", object(1, 3, 10 * kSecond), 1, 10 * kSecond);
  history.state("a", object(1, 1, 10 * kSecond), 1, 14 * kSecond);
  ASSERT_EQ(history.find("a")->samples.size(), 2u);
  EXPECT_EQ(history.find("a")->samples[1].stamp_ns, 14 * kSecond);
}

TEST(History, KeepsNothingThatSaysNothingNew) {
  History history;
  for (int i = 0; i < 9; ++i) history.state("a", object(1, 1, kSecond + i), 1, kSecond + i);
  EXPECT_EQ(history.find("a")->samples.size(), 1u);
}

TEST(History, LongPastsAreThinnedFirstAndLastStay) {
  History history;
  for (int i = 0; i < 5000; ++i) history.state("a", object(i % 7, 1, i * kSecond), 1, i * kSecond);
  const auto& samples = history.find("a")->samples;
  EXPECT_LE(samples.size(), History::kMostSamples);
  EXPECT_GT(samples.size(), History::kMostSamples / 2);
  EXPECT_EQ(samples.front().stamp_ns, 0);
  EXPECT_EQ(samples.back().stamp_ns, 4999 * kSecond);
}

TEST(History, OfTooManyObjectsTheFirstThatWentAreForgotten) {
  History history;
  for (std::size_t i = 0; i < History::kMostObjects + 100; ++i) {
    const std::string uuid = std::to_string(i);
    history.state(uuid, object(0, 1, kSecond), 1, kSecond);
    if (i < 300) history.gone(uuid, kSecond);
  }
  EXPECT_EQ(history.size(), History::kMostObjects);
  EXPECT_EQ(history.find("0"), nullptr);
  EXPECT_EQ(history.find("99"), nullptr);
  EXPECT_NE(history.find("100"), nullptr);
}

ObjectSample sample(double x, StampNs stamp_ns) {
  ObjectSample sample;
  sample.stamp_ns = stamp_ns;
  sample.box.pose.position_W.x() = x;
  return sample;
}

// The log of a node comes after what it says now.
TEST(History, WhatALogSaysOfBeforeGoesBeforeWhatIsKnown) {
  History history;
  history.state("a", object(3, 1, 100 * kSecond, 50 * kSecond), 1, 100 * kSecond);
  history.logged("a", object(0, 1, 0), 1, sample(1, 10 * kSecond), false);
  history.logged("a", object(0, 1, 0), 1, sample(2, 20 * kSecond), false);
  const auto x = [&](StampNs at) { return history.at(at).at(0).second.box.pose.position_W.x(); };
  EXPECT_TRUE(history.at(9 * kSecond).empty());
  EXPECT_EQ(x(10 * kSecond), 1);
  EXPECT_EQ(x(99 * kSecond), 2);
  EXPECT_EQ(x(100 * kSecond), 3);
  // What has gone before this run was never heard of.
  history.logged("b", object(0, 1, 0), 1, sample(1, 10 * kSecond), false);
  history.logged("b", object(0, 1, 0), 1, sample(1, 30 * kSecond), true);
  EXPECT_EQ(history.at(29 * kSecond).size(), 2u);
  EXPECT_EQ(history.at(30 * kSecond).size(), 1u);
  // One that has gone in the log and is there now was found again.
  history.logged("a", object(0, 1, 0), 1, sample(2, 40 * kSecond), true);
  EXPECT_EQ(x(100 * kSecond), 3);
}

TEST(NewestLog, OneEntryPerKeyInTheOrderOfWriting) {
  NewestLog<std::string, int> log;
  log.put("a", 1);
  log.put("b", 2);
  log.put("a", 3);
  const auto [key, entry] = log.after(0);
  EXPECT_EQ(*key, "b");
  EXPECT_EQ(*log.after(entry->revision).first, "a");
  EXPECT_EQ(log.size(), 2u);
  log.forget("a");
  EXPECT_EQ(log.pruned(), 3u);
  EXPECT_EQ(log.after(entry->revision).first, nullptr);
}

}  // namespace
}  // namespace pocd::view::testing
