// When a copy joins the bus anew.
#include <gtest/gtest.h>

#include <vector>

#include "mirror/rejoin_plan.hpp"

namespace pocd::dds {
namespace {

using std::chrono::seconds;

TEST(RejoinPlan, AfterFifteenSecondsOfSilenceAndThenLessAndLessOften) {
  RejoinPlan plan;
  RejoinPlan::Time now{};
  std::vector<int> joined;
  for (int second = 0; second < 1000; ++second, now += seconds(1)) {
    if (plan.due(now, seconds(second))) joined.push_back(second);
  }
  EXPECT_EQ(joined, (std::vector<int>{15, 30, 60, 120, 240, 480, 720, 960}));
  EXPECT_FALSE(plan.due(now, seconds(1))) << "heard";
  EXPECT_FALSE(plan.due(now, seconds(14)));
  EXPECT_TRUE(plan.due(now, seconds(15)));
  EXPECT_FALSE(plan.due(now + seconds(14), seconds(29)));
  EXPECT_TRUE(plan.due(now + seconds(15), seconds(30)));
}

}  // namespace
}  // namespace pocd::dds
