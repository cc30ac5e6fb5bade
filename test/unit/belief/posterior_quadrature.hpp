// Moments of the exact posterior of the POCD update by numerical integration: knows only the
// likelihood and the prior, none of the closed forms under test. Slow and obvious on purpose.
#pragma once

#include <vector>

#include "pocd/belief/bayesian_update.hpp"

namespace pocd::test {

/// Points and weights of a rule that has absorbed the (normalised) prior density.
struct Rule {
  std::vector<double> x;
  std::vector<double> one_minus_x;  ///< v only: 1 - v without cancellation
  std::vector<double> weight;
};

struct Moments {
  double mean_l, variance_l;
  double mean_v, mean_one_minus_v, variance_v;
};

/// Integrates against Beta(v; alpha, beta) on (0, 1), end point singularities included.
Rule beta_rule(double alpha, double beta);

/// Integrates against Normal(l; mu, sigma^2), with panels fine enough for a factor
/// Normal(delta; l, tau^2).
Rule normal_rule(const Belief& prior, double delta_m, double tau_m);

/// Integral over l and v of likelihood times prior as a sum over v of a sum over l; O(n m).
Moments posterior_moments_2d(const Belief& prior, const Measurement& z, double delta_max_m);

/// The same integral, term by term: the likelihood is a sum of two products f(l) g(v), and the
/// integral of each is the product of two one-dimensional ones (Fubini); O(n + m).
Moments posterior_moments(const Belief& prior, const Measurement& z, double delta_max_m);

}  // namespace pocd::test
