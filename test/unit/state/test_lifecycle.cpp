#include "pocd/state/lifecycle.hpp"

#include <gtest/gtest.h>

#include "pocd/common/random.hpp"
#include "pocd/state/bayesian_update.hpp"

namespace pocd {
namespace {

const StateConfig kState;
const ChangeConfig kChange;

LibraryObject known_object(int stationarity_class = 0) {
  LibraryObject object(ObjectId{1}, 0.05);
  object.confirmed = true;
  object.stationarity_class = stationarity_class;
  object.observations = 10;
  object.belief = {0.0, 0.1, 8.0, 2.0};
  return object;
}

Belief random_belief(Random& random) {
  const double count = std::exp(random.uniform(std::log(0.2), std::log(kState.max_count)));
  const double mean = random.uniform(0.02, 0.98);
  return {random.uniform(-0.3, 0.3), std::exp(random.uniform(std::log(0.1), std::log(1.0))),
          mean * count, (1 - mean) * count};
}

TEST(ApplyMeasurement, EvidenceAloneGivesTheBeliefAfterIt) {
  Random random(51);
  for (int i = 0; i < 2000; ++i) {
    LibraryObject object = known_object(static_cast<int>(random.below(2)));
    object.belief = random_belief(random);
    const double delta_m = random.uniform(-1.2, 1.2) * kChange.delta_max_m * (i % 2 ? 1.0 : 0.05);
    const double sigma_m = random.uniform(0.1, 0.4);
    const Evidence e = apply_measurement(object, delta_m, sigma_m, {}, kState, kChange);
    const Belief again = next_belief(
        e.before, {e.delta_m, e.stationarity_class, e.measurement_sigma_m, e.k}, kState, kChange);
    ASSERT_EQ(e.measurement_sigma_m, sigma_m);
    ASSERT_EQ(again.mu, e.after.mu);
    ASSERT_EQ(again.sigma, e.after.sigma);
    ASSERT_EQ(again.alpha, e.after.alpha);
    ASSERT_EQ(again.beta, e.after.beta);
    ASSERT_EQ(object.belief.alpha, e.after.alpha) << "the object has it";
    ASSERT_NEAR(e.c1 + e.c2, 1.0, 1e-12);
    ASSERT_LE(std::abs(e.delta_m), kChange.delta_max_m);
  }
}

TEST(ApplyMeasurement, EvidenceSaysHowMuchWasSeen) {
  Sighting s;
  s.total = 100;
  s.hit = 30;
  s.seen_through = 10;
  LibraryObject object = known_object(1);
  const Evidence e = apply_measurement(object, 0.01, 0.23, s, kState, kChange);
  EXPECT_EQ(e.visible_share, 0.4);
  EXPECT_EQ(e.seen_through_share, 0.25);
  EXPECT_EQ(e.stationarity_class, 1);
  EXPECT_EQ(e.measurement_sigma_m, 0.23);
  EXPECT_TRUE(e.rule.empty());
}

TEST(ApplyMeasurement, KFollowsClassAndKind) {
  for (const int s : {0, 1}) {
    for (const double delta_m : {0.0, kChange.delta_max_m}) {
      LibraryObject object = known_object(s);
      const bool inlier = delta_m == 0.0;
      EXPECT_EQ(apply_measurement(object, delta_m, kChange.tau_m, {}, kState, kChange).k,
                inlier == (s == 1) ? kState.k : 0.0);
    }
  }
}

TEST(NextBelief, IsTheBayesianStepWithItsBounds) {
  Random random(52);
  int bounded = 0;
  for (int i = 0; i < 2000; ++i) {
    const Belief before = random_belief(random);
    const int s = static_cast<int>(random.below(2));
    const double k = random.below(2) ? kState.k : 0.0;
    const double delta_m = random.uniform(-0.3, 0.3);
    const Belief plain =
        bayesian_update(before, {delta_m, s, kChange.tau_m, k}, kChange.delta_max_m).belief;
    const Belief after = next_belief(before, {delta_m, s, kChange.tau_m, k}, kState, kChange);
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
  const Belief after = next_belief(before, {0.0, 1, kChange.tau_m, 3.0}, state, kChange);
  EXPECT_EQ(after.alpha, before.alpha);
  EXPECT_EQ(after.beta, before.beta);
  EXPECT_LT(std::abs(after.mu), std::abs(before.mu)) << "what is known of l goes on";
  EXPECT_LT(after.sigma, before.sigma);
  // What lowers the score is applied from there all the same.
  EXPECT_LT(next_belief(before, {kChange.delta_max_m, 0, kChange.tau_m, 3.0}, state, kChange)
                .stationarity(),
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
          next_belief(belief, {moved_m, 1, kChange.tau_m, kState.k}, state, kChange);
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
