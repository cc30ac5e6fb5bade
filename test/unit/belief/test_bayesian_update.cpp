#include "pocd/belief/bayesian_update.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "pocd/common/random.hpp"
#include "posterior_quadrature.hpp"

namespace pocd {
namespace {

double log_uniform(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

struct Case {
  Belief prior;
  Measurement z;
  double delta_max_m;
};

// s in {0, 1}, k in {0, 3}, |Delta| up to Delta_max, counts over nine decades, both noises over
// five.
Case random_case(Random& random, int index) {
  Case c;
  c.delta_max_m = log_uniform(random, 0.1, 10.0);
  c.prior.alpha = log_uniform(random, 1e-3, 1e6);
  c.prior.beta = log_uniform(random, 1e-3, 1e6);
  c.prior.sigma = log_uniform(random, 1e-3, 1e2);
  c.prior.mu = random.uniform(-c.delta_max_m, c.delta_max_m);
  c.z.sigma_m = log_uniform(random, 1e-3, 1e2);
  c.z.stationarity_class = index & 1;
  c.z.k = index & 2 ? 3.0 : 0.0;
  // Half of the measurements near the prior, or the wide sweep would see almost no inlier.
  const double spread = 3.0 * std::hypot(c.prior.sigma, c.z.sigma_m);
  const double delta = index & 4 ? random.uniform(-c.delta_max_m, c.delta_max_m)
                                 : c.prior.mu + spread * random.uniform(-1.0, 1.0);
  c.z.delta_m = std::clamp(delta, -c.delta_max_m, c.delta_max_m);
  return c;
}

std::string describe(const Case& c) {
  return "mu " + std::to_string(c.prior.mu) + " sigma " + std::to_string(c.prior.sigma) +
         " alpha " + std::to_string(c.prior.alpha) + " beta " + std::to_string(c.prior.beta) +
         " delta " + std::to_string(c.z.delta_m) + " tau " + std::to_string(c.z.sigma_m) + " k " +
         std::to_string(c.z.k) + " s " + std::to_string(c.z.stationarity_class) + " delta_max " +
         std::to_string(c.delta_max_m);
}

void expect_moments(const Belief& q, const test::Moments& exact, double relative) {
  const double count = q.alpha + q.beta;
  EXPECT_NEAR((q.mu - exact.mean_l) / std::sqrt(exact.variance_l), 0.0, relative);
  EXPECT_NEAR(q.sigma * q.sigma / exact.variance_l, 1.0, relative);
  EXPECT_NEAR(q.alpha / count / exact.mean_v, 1.0, relative);
  EXPECT_NEAR(q.beta / count / exact.mean_one_minus_v, 1.0, relative);
  EXPECT_NEAR(q.alpha / count * (q.beta / count) / (count + 1.0) / exact.variance_v, 1.0, relative);
}

// The reference itself: moments of Beta and Normal that are known.
TEST(PosteriorQuadrature, KnowsThePrior) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const double a = log_uniform(random, 1e-3, 1e6), b = log_uniform(random, 1e-3, 1e6);
    SCOPED_TRACE(std::to_string(a) + " " + std::to_string(b));
    const test::Rule rule = test::beta_rule(a, b);
    double mean_v = 0.0, mean_w = 0.0, product = 0.0;
    for (std::size_t j = 0; j < rule.x.size(); ++j) {
      mean_v += rule.weight[j] * rule.x[j];
      mean_w += rule.weight[j] * rule.one_minus_x[j];
      product += rule.weight[j] * rule.x[j] * rule.one_minus_x[j];
    }
    const double n = a + b;
    EXPECT_NEAR(mean_v * n / a, 1.0, 1e-9);
    EXPECT_NEAR(mean_w * n / b, 1.0, 1e-9);
    EXPECT_NEAR(product * n * (n + 1.0) / (a * b), 1.0, 1e-9);
  }
}

TEST(PosteriorQuadrature, ProductFormEqualsPlaneIntegral) {
  Random random(2);
  for (int i = 0; i < 8; ++i) {
    const Case c = random_case(random, i);
    SCOPED_TRACE(describe(c));
    const test::Moments one = test::posterior_moments(c.prior, c.z, c.delta_max_m);
    const test::Moments two = test::posterior_moments_2d(c.prior, c.z, c.delta_max_m);
    EXPECT_NEAR(one.mean_l, two.mean_l, 1e-10 * std::sqrt(two.variance_l));
    EXPECT_NEAR(one.variance_l / two.variance_l, 1.0, 1e-10);
    EXPECT_NEAR(one.mean_v / two.mean_v, 1.0, 1e-10);
    EXPECT_NEAR(one.variance_v / two.variance_v, 1.0, 1e-10);
  }
}

// 1e-6 is required; the bound is relative to each moment, so that tiny ones are tested as well.
TEST(BayesianUpdate, MatchesMomentsOfExactPosterior) {
  Random random(3);
  int inliers = 0, outliers = 0, undecided = 0;
  for (int i = 0; i < 2000 && !HasFailure(); ++i) {
    const Case c = random_case(random, i);
    SCOPED_TRACE(describe(c));
    const UpdateResult result = bayesian_update(c.prior, c.z, c.delta_max_m);
    EXPECT_NEAR(result.c1 + result.c2, 1.0, 1e-15);
    (result.c1 > 0.99 ? inliers : result.c1 < 0.01 ? outliers : undecided)++;
    expect_moments(result.belief, test::posterior_moments(c.prior, c.z, c.delta_max_m), 1e-6);
  }
  // The sweep must not have degenerated to one kind of measurement.
  EXPECT_GT(inliers, 200);
  EXPECT_GT(outliers, 200);
  EXPECT_GT(undecided, 200);
}

TEST(BayesianUpdate, StaysFiniteAndPositiveAtExtremes) {
  for (double alpha : {1e-3, 1.0, 1e6}) {
    for (double beta : {1e-3, 1.0, 1e6}) {
      for (double sigma : {1e-6, 1.0, 1e3}) {
        for (double tau : {1e-6, 0.2, 1e3}) {
          for (double delta : {0.0, 1e-9, 4.0, -4.0, 1e9}) {
            for (double mu : {0.0, 4.0}) {
              for (int s : {0, 1}) {
                for (double k : {0.0, 3.0}) {
                  Belief belief{mu, sigma, alpha, beta};
                  for (int repeat = 0; repeat < 20; ++repeat) {
                    const auto result = bayesian_update(belief, {delta, s, tau, k}, 4.0);
                    belief = result.belief;
                    ASSERT_TRUE(std::isfinite(belief.mu));
                    ASSERT_TRUE(std::isfinite(belief.sigma) && belief.sigma > 0.0);
                    ASSERT_TRUE(std::isfinite(belief.alpha) && belief.alpha > 0.0);
                    ASSERT_TRUE(std::isfinite(belief.beta) && belief.beta > 0.0);
                    ASSERT_TRUE(result.c1 >= 0.0 && result.c2 >= 0.0);
                  }
                }
              }
            }
          }
        }
      }
    }
  }
}

// At k = 0 the score rises exactly where the inlier density exceeds that of the uniform outlier.
TEST(BayesianUpdate, InlierRaisesAndOutlierLowersStationarity) {
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    Case c = random_case(random, i);
    c.z.k = 0.0;
    c.prior.alpha = log_uniform(random, 0.1, 1e3);
    c.prior.beta = log_uniform(random, 0.1, 1e3);
    const double deviation = std::hypot(c.prior.sigma, c.z.sigma_m);
    const double r = (c.z.delta_m - c.prior.mu) / deviation;
    const double density = std::exp(-0.5 * r * r) / (deviation * std::sqrt(2.0 * std::acos(-1.0)));
    const double ratio = density * 2.0 * c.delta_max_m;
    if (std::abs(ratio - 1.0) < 1e-6) continue;
    SCOPED_TRACE(describe(c));
    const Belief after = bayesian_update(c.prior, c.z, c.delta_max_m).belief;
    EXPECT_EQ(ratio > 1.0, after.stationarity() > c.prior.stationarity());
    EXPECT_EQ(ratio > 1.0,
              inlier_probability(c.prior, c.z, c.delta_max_m) > c.prior.stationarity());
  }
}

TEST(BayesianUpdate, MeasurementBeyondDeltaMaxCountsAsDeltaMax) {
  const Belief prior{0.0, 0.5, 0.67, 0.33};
  const UpdateResult at = bayesian_update(prior, {4.0, 0, 0.2, 3.0}, 4.0);
  const UpdateResult beyond = bayesian_update(prior, {1e6, 0, 0.2, 3.0}, 4.0);
  EXPECT_EQ(at.belief.mu, beyond.belief.mu);
  EXPECT_EQ(at.belief.alpha, beyond.belief.alpha);
  EXPECT_EQ(at.belief.beta, beyond.belief.beta);
}

// The published warehouse parameters: one unexplained absence of a movable object is not enough to
// prune it with k = 0, but is with k = 3 (E[v] = 0.67 / 5 below 0.4).
TEST(BayesianUpdate, WarehouseParameters) {
  const Belief prior{0.0, 0.5, 0.67, 0.33};
  const Measurement gone{4.0, 0, 0.2, 0.0};
  EXPECT_NEAR(bayesian_update(prior, gone, 4.0).belief.stationarity(), 0.67 / 2.0, 1e-9);
  Measurement weighted = gone;
  weighted.k = adaptive_k(prior, gone, 4.0);
  EXPECT_NEAR(bayesian_update(prior, weighted, 4.0).belief.stationarity(), 0.67 / 5.0, 1e-9);
}

TEST(AdaptiveK, FollowsClassAndKindOfMeasurement) {
  const Belief prior{0.0, 0.5, 2.0, 1.0};
  const Measurement stays_movable{0.0, 0, 0.2, 0.0}, stays_static{0.0, 1, 0.2, 0.0};
  const Measurement moves_movable{4.0, 0, 0.2, 0.0}, moves_static{4.0, 1, 0.2, 0.0};
  EXPECT_EQ(adaptive_k(prior, moves_movable, 4.0), 3.0);
  EXPECT_EQ(adaptive_k(prior, stays_movable, 4.0), 0.0);
  EXPECT_EQ(adaptive_k(prior, moves_static, 4.0), 0.0);
  EXPECT_EQ(adaptive_k(prior, stays_static, 4.0), 3.0);
  EXPECT_EQ(adaptive_k(prior, stays_static, 4.0, 1.5), 1.5);
}

TEST(ClampCounts, KeepsTheMeanAndCapsTheSum) {
  const Belief belief{0.1, 0.2, 300.0, 100.0};
  const Belief capped = clamp_counts(belief, 20.0);
  EXPECT_NEAR(capped.alpha + capped.beta, 20.0, 1e-12);
  EXPECT_NEAR(capped.stationarity(), 0.75, 1e-12);
  EXPECT_EQ(capped.mu, belief.mu);
  EXPECT_EQ(capped.sigma, belief.sigma);
  EXPECT_EQ(clamp_counts(belief, 400.0).alpha, belief.alpha);
}

TEST(BayesianUpdate, RefusesArgumentsOutsideTheirRange) {
  const Belief prior;
  EXPECT_THROW(bayesian_update(prior, {std::nan(""), 0, 0.2, 0.0}, 4.0), std::logic_error);
  EXPECT_THROW(bayesian_update(prior, {0.0, 2, 0.2, 0.0}, 4.0), std::logic_error);
  EXPECT_THROW(bayesian_update(prior, {0.0, 0, 0.0, 0.0}, 4.0), std::logic_error);
  EXPECT_THROW(bayesian_update(prior, {0.0, 0, 0.2, -1.0}, 4.0), std::logic_error);
  EXPECT_THROW(bayesian_update(prior, {0.0, 0, 0.2, 0.0}, 0.0), std::logic_error);
  EXPECT_THROW(bayesian_update({0.0, 0.5, 0.0, 1.0}, {}, 4.0), std::logic_error);
  EXPECT_THROW(clamp_counts(prior, 0.0), std::logic_error);
}

}  // namespace
}  // namespace pocd
