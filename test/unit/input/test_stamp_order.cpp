// When a stream whose stamps do not rise is taken to have started anew.
#include "pocd/input/stamp_order.hpp"

#include <gtest/gtest.h>

namespace pocd {
namespace {

using Verdict = StampOrder::Verdict;
constexpr StampNs kSecond = 1'000'000'000;

/// How many of `count` stamps from `first_ns` on are refused before the stream starts anew; -1 when
/// it never does.
int refused_before_restart(StampOrder& order, StampNs first_ns, StampNs step_ns, int count) {
  for (int i = 0; i < count; ++i) {
    const Verdict verdict = order.judge(first_ns + i * step_ns);
    EXPECT_NE(verdict, Verdict::kAccepted);
    if (verdict == Verdict::kRestarted) return i;
  }
  return -1;
}

TEST(StampOrder, StartsAnewAfterRefusedStampsThatRise) {
  StampOrder order;
  EXPECT_EQ(order.judge(1000 * kSecond), Verdict::kAccepted);
  EXPECT_EQ(refused_before_restart(order, 5 * kSecond, 1, 100), StampOrder::kAgreeing - 1);
  EXPECT_EQ(order.newest_ns(), 5 * kSecond + StampOrder::kAgreeing - 1);
  EXPECT_EQ(order.judge(6 * kSecond), Verdict::kAccepted);
}

TEST(StampOrder, RefusedStampsThatDoNotAgreeStartNothing) {
  StampOrder standing, falling, near;
  for (StampOrder* order : {&standing, &falling, &near}) order->judge(1000 * kSecond);
  EXPECT_EQ(refused_before_restart(standing, 5 * kSecond, 0, 100), -1);
  EXPECT_EQ(refused_before_restart(falling, 5 * kSecond, -1, 100), -1);
  // A second source that lags, however many samples it sends between two of the first.
  EXPECT_EQ(refused_before_restart(near, 999 * kSecond, kSecond / 200, 100), -1);
}

TEST(StampOrder, AnAcceptedStampEndsTheRow) {
  StampOrder order;
  order.judge(1000 * kSecond);
  for (int round = 1; round < 5; ++round) {
    EXPECT_EQ(refused_before_restart(order, round * kSecond, 1, StampOrder::kAgreeing - 1), -1);
    EXPECT_EQ(order.judge((1000 + round) * kSecond), Verdict::kAccepted);
  }
}

TEST(StampOrder, SaysWhatHappened) {
  EXPECT_FALSE(stamp_problem(Verdict::kAccepted, 2, 1));
  const auto backwards = stamp_problem(Verdict::kRefused, 1, 2);
  EXPECT_EQ(backwards->reason, InputReason::kStampBackwards);
  EXPECT_EQ(backwards->detail, "stamp 1 ns is not after the last one, 2 ns");
  const auto restarted = stamp_problem(Verdict::kRestarted, 1, 2);
  EXPECT_EQ(restarted->reason, InputReason::kStampsRestarted);
  EXPECT_EQ(restarted->detail,
            "stamp 1 ns is the 10th in a row far before 2 ns: the stream starts anew with it");
}

}  // namespace
}  // namespace pocd
