#include "pocd/belief/next_belief.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "random_belief.hpp"

namespace pocd {
namespace {

const StateConfig kState;
const ChangeConfig kChange;

TEST(NextBelief, IsTheBayesianStepWithItsBounds) {
  Random random(52);
  int bounded = 0;
  for (int i = 0; i < 2000; ++i) {
    const Belief before = random_belief(random, kState);
    const int s = static_cast<int>(random.below(2));
    const double k = random.below(2) ? kState.k : 0.0;
    const double delta_m = random.uniform(-0.3, 0.3);
    const Belief plain =
        bayesian_update(before, {delta_m, s, kChange.tau_m, k}, kChange.delta_max_m).belief;
    const Belief after =
        next_belief(before, {delta_m, s, kChange.tau_m, k}, kState, kChange).belief;
    ASSERT_LE(after.alpha + after.beta, kState.max_count * (1 + 1e-12));
    ASSERT_GE(after.sigma, kState.min_sigma_share * kChange.tau_m);
    ASSERT_NEAR(after.stationarity(), plain.stationarity(), 1e-12) << "the cap keeps E[v]";
    ASSERT_EQ(after.mu, plain.mu);
    bounded += after.alpha + after.beta < plain.alpha + plain.beta;
  }
  EXPECT_GT(bounded, 50);
}

TEST(NextBelief, TheBoundVMaxIsOnTheScoreAlone) {
  StateConfig state;
  state.max_stationarity = 0.9;
  const Belief before{0.02, 0.4, 8.9, 1.1};
  ASSERT_GT(bayesian_update(before, {0.0, 1, kChange.tau_m, 3.0}, kChange.delta_max_m)
                .belief.stationarity(),
            state.max_stationarity);
  const Belief after = next_belief(before, {0.0, 1, kChange.tau_m, 3.0}, state, kChange).belief;
  EXPECT_EQ(after.alpha, before.alpha);
  EXPECT_EQ(after.beta, before.beta);
  EXPECT_LT(std::abs(after.mu), std::abs(before.mu)) << "what is known of l goes on";
  EXPECT_LT(after.sigma, before.sigma);
  // What lowers the score is applied from there all the same.
  EXPECT_LT(next_belief(before, {kChange.delta_max_m, 0, kChange.tau_m, 3.0}, state, kChange)
                .belief.stationarity(),
            before.stationarity());
}

// At the bound an object that creeps was believed to stay: its mu froze.
TEST(NextBelief, AtVMaxTheChangeIsFollowedFromEveryBelief) {
  Random random(53);
  StateConfig state;
  int at_bound = 0;
  for (int i = 0; i < 200; ++i) {
    state.max_stationarity = random.uniform(0.6, 0.95);
    Belief belief{0.0, random.uniform(0.15, 0.5), 0.0, 0.0};
    belief.alpha = state.max_stationarity * state.max_count;
    belief.beta = state.max_count - belief.alpha;
    const double moved_m = random.uniform(-0.08, 0.08);
    const double first_m = std::abs(belief.mu - moved_m);
    for (int k = 0; k < 30; ++k) {
      const Belief next =
          next_belief(belief, {moved_m, 1, kChange.tau_m, kState.k}, state, kChange).belief;
      at_bound += next.alpha == belief.alpha && next.beta == belief.beta;
      belief = next;
    }
    ASSERT_LT(std::abs(belief.mu - moved_m), 0.2 * first_m) << "moved by " << moved_m;
    ASSERT_LE(belief.stationarity(), state.max_stationarity + 1e-9);
  }
  EXPECT_GT(at_bound, 1000) << "the bound was met";
}

}  // namespace
}  // namespace pocd
