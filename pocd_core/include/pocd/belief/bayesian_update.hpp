// The Gaussian-Beta update of an object's belief by one measurement of geometric change (Qian et
// al., RSS 2022, Section IV-D): the exact posterior is a mixture of an inlier and an outlier term;
// it is replaced by the belief with the same mean and variance of l and of v.
#pragma once

#include "pocd/belief/belief.hpp"

namespace pocd {

/// z = (Delta, s) and how to weigh it.
struct Measurement {
  double delta_m = 0.0;        ///< measured geometric change; clamped to [-delta_max, delta_max]
  int stationarity_class = 0;  ///< s: 0 movable, 1 static
  double sigma_m = 0.2;        ///< tau, one sigma of delta_m, > 0
  double k = 0.0;              ///< weight of the semantic likelihood, >= 0
};

/// Posterior and the probabilities that the measurement was an inlier (c1) or an outlier (c2).
struct UpdateResult {
  Belief belief;
  double c1 = 0.0;
  double c2 = 0.0;  ///< c1 + c2 = 1 up to rounding; each is computed without cancellation
};

/// Pure function. Finite with sigma, alpha, beta > 0 for every finite, positive belief: computed in
/// log space and without differences of nearly equal numbers. `delta_max_m` > 0 bounds the uniform
/// distribution of outliers. Throws std::logic_error for arguments outside these ranges.
UpdateResult bayesian_update(const Belief& prior, const Measurement& measurement,
                             double delta_max_m);

/// C1 of the measurement by geometry alone (as if k = 0). Equals E[v] of the prior exactly where
/// the inlier density is that of the uniform distribution; above it the update at k = 0 raises
/// E[v].
double inlier_probability(const Belief& prior, const Measurement& measurement, double delta_max_m);

/// The weight k that "balances semantics against geometry": for s = 0, `k_value` for an outlier and
/// 0 for an inlier; for s = 1 the reverse. A measurement is an inlier when C1 >= C2 at k = 0.
/// `measurement.k` is ignored.
double adaptive_k(const Belief& prior, const Measurement& measurement, double delta_max_m,
                  double k_value = 3.0);

/// Scales alpha and beta so that alpha + beta <= max_count (> 0), which keeps E[v] and bounds the
/// number of measurements an old object needs to change its mind. mu and sigma stay.
Belief clamp_counts(const Belief& belief, double max_count);

}  // namespace pocd
