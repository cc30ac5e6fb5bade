#include "pocd/track/apply_measurement.hpp"

#include <gtest/gtest.h>

#include "random_belief.hpp"

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

TEST(ApplyMeasurement, EvidenceAloneGivesTheBeliefAfterIt) {
  Random random(51);
  for (int i = 0; i < 2000; ++i) {
    LibraryObject object = known_object(static_cast<int>(random.below(2)));
    object.belief = random_belief(random, kState);
    const double delta_m = random.uniform(-1.2, 1.2) * kChange.delta_max_m * (i % 2 ? 1.0 : 0.05);
    const double sigma_m = random.uniform(0.1, 0.4);
    const Evidence e = apply_measurement(object, delta_m, sigma_m, {}, kState, kChange);
    const Belief again =
        next_belief(e.before, {e.delta_m, e.stationarity_class, e.measurement_sigma_m, e.k}, kState,
                    kChange)
            .belief;
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

}  // namespace
}  // namespace pocd
