// How the level of a node's health follows what it counts.
#include <gtest/gtest.h>

#include "node/health_rule.hpp"

namespace pocd::dds {
namespace {

constexpr double kWindowS = 10.0, kStallS = 5.0;

HealthRule::Time at(double second) {
  return HealthRule::Time{} + std::chrono::milliseconds(static_cast<long>(1e3 * second));
}

TEST(HealthRule, EverythingCountsForItsWindowAndNoLonger) {
  struct Case {
    std::uint64_t HealthSigns::*counter;
    int level;
  };
  for (const Case& one : {Case{&HealthSigns::write_failures, 2}, Case{&HealthSigns::problems, 1},
                          Case{&HealthSigns::dropped, 1}, Case{&HealthSigns::output_failures, 1}}) {
    HealthRule rule(kWindowS, kStallS);
    HealthSigns signs;
    EXPECT_EQ(rule.judge(signs, at(1)).level, 0);
    signs.*one.counter = 1;
    EXPECT_EQ(rule.judge(signs, at(2)).level, one.level);
    EXPECT_EQ(rule.judge(signs, at(11.9)).level, one.level);
    EXPECT_EQ(rule.judge(signs, at(12)).level, 0) << "it has recovered";
    signs.*one.counter = 2;
    EXPECT_EQ(rule.judge(signs, at(50)).level, one.level) << "and fails again";
    EXPECT_EQ(rule.judge(signs, at(60)).level, 0);
    signs.*one.counter = 0;
    EXPECT_EQ(rule.judge(signs, at(61)).level, 0) << "a count that goes back is nothing new";
  }
}

TEST(HealthRule, TheWorstIsSaid) {
  HealthRule rule(kWindowS, kStallS);
  HealthSigns signs;
  signs.problems = signs.dropped = signs.write_failures = 1;
  signs.still_s = 6.5;
  signs.still_thread = "the pipeline";
  HealthVerdict verdict = rule.judge(signs, at(1));
  EXPECT_EQ(verdict.level, 2);
  EXPECT_EQ(verdict.why, "the pipeline has not ended a turn for 6 s");
  signs.still_s = 0.05;
  verdict = rule.judge(signs, at(2));
  EXPECT_EQ(verdict.why, "samples could not be written");
  verdict = rule.judge(signs, at(12));
  EXPECT_EQ(verdict.level, 0);
  EXPECT_EQ(verdict.why, "");
}

}  // namespace
}  // namespace pocd::dds
