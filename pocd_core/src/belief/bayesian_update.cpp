#include "pocd/belief/bayesian_update.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr double kLogTwoPi = 1.8378770664093454836;

bool positive(double x) { return std::isfinite(x) && x > 0.0; }

void check_arguments(const Belief& prior, const Measurement& z, double delta_max_m) {
  POCD_CHECK(std::isfinite(prior.mu) && positive(prior.sigma));
  POCD_CHECK(positive(prior.alpha) && positive(prior.beta));
  POCD_CHECK(std::isfinite(z.delta_m) && positive(z.sigma_m));
  POCD_CHECK(z.stationarity_class == 0 || z.stationarity_class == 1);
  POCD_CHECK(std::isfinite(z.k) && z.k >= 0.0);
  POCD_CHECK(positive(delta_max_m));
}

struct Weights {
  double c1, c2;
};

// C1 and C2 for the counts a = alpha + k s, b = beta + k (1 - s). Their common factor
// 1 / (alpha + beta + k) cancels in the normalisation.
Weights mixture_weights(double a, double b, double delta_m, double mu, double predicted_sigma_m,
                        double delta_max_m) {
  const double r = (delta_m - mu) / predicted_sigma_m;
  const double log_inlier = std::log(a) - 0.5 * (kLogTwoPi + r * r) - std::log(predicted_sigma_m);
  const double log_outlier = std::log(b) - std::log(2.0 * delta_max_m);
  // Both by the logistic function, not one as 1 minus the other: each keeps its relative accuracy.
  const double odds_log = log_inlier - log_outlier;
  return {1.0 / (1.0 + std::exp(-odds_log)), 1.0 / (1.0 + std::exp(odds_log))};
}

Weights geometric_weights(const Belief& prior, const Measurement& z, double delta_max_m) {
  check_arguments(prior, z, delta_max_m);
  const double delta = std::clamp(z.delta_m, -delta_max_m, delta_max_m);
  return mixture_weights(prior.alpha, prior.beta, delta, prior.mu,
                         std::hypot(prior.sigma, z.sigma_m), delta_max_m);
}

}  // namespace

UpdateResult bayesian_update(const Belief& prior, const Measurement& z, double delta_max_m) {
  check_arguments(prior, z, delta_max_m);
  const double delta = std::clamp(z.delta_m, -delta_max_m, delta_max_m);
  const double a = prior.alpha + z.k * z.stationarity_class;
  const double b = prior.beta + z.k * (1 - z.stationarity_class);
  const double predicted_sigma = std::hypot(prior.sigma, z.sigma_m);
  const auto [c1, c2] = mixture_weights(a, b, delta, prior.mu, predicted_sigma, delta_max_m);

  // l: the inlier term has mean m = mu + shift and deviation g. The mixture's variance in the form
  // sum of C_i var_i + C1 C2 (m - mu)^2 has only positive terms.
  const double gain_root = prior.sigma / predicted_sigma;
  const double shift = gain_root * gain_root * (delta - prior.mu);
  const double g = gain_root * z.sigma_m;
  UpdateResult result;
  result.c1 = c1;
  result.c2 = c2;
  result.belief.mu = prior.mu + c1 * shift;
  result.belief.sigma =
      std::sqrt(c1 * g * g + c2 * prior.sigma * prior.sigma + c1 * c2 * shift * shift);

  // v: with n = a + b + 1, theta = (a + C1) / n, q = C1 C2 and p = a b + C1 b + C2 a,
  //   theta (1 - theta) = (p + q) / n^2,   var[v] = (p / (n + 1) + q) / n^2,
  // so alpha' + beta' = theta (1 - theta) / var[v] - 1 = n p / (p + q (n + 1)): the same as the
  // published quotient by omega - theta^2, without its cancellation.
  const double n = a + b + 1.0;
  const double p = a * b + c1 * b + c2 * a;
  const double scale = p / (p + c1 * c2 * (n + 1.0));
  result.belief.alpha = scale * (a + c1);
  result.belief.beta = scale * (b + c2);
  return result;
}

double inlier_probability(const Belief& prior, const Measurement& z, double delta_max_m) {
  return geometric_weights(prior, z, delta_max_m).c1;
}

double adaptive_k(const Belief& prior, const Measurement& z, double delta_max_m, double k_value) {
  POCD_CHECK(std::isfinite(k_value) && k_value >= 0.0);
  const Weights c = geometric_weights(prior, z, delta_max_m);
  const bool inlier = c.c1 >= c.c2;
  return inlier == (z.stationarity_class == 1) ? k_value : 0.0;
}

Belief clamp_counts(const Belief& belief, double max_count) {
  POCD_CHECK(positive(belief.alpha) && positive(belief.beta) && positive(max_count));
  Belief result = belief;
  const double count = belief.alpha + belief.beta;
  if (count > max_count) {
    result.alpha *= max_count / count;
    result.beta *= max_count / count;
  }
  return result;
}

}  // namespace pocd
