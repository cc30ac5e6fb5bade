// The belief about one object: q(l, v) = Normal(l; mu, sigma^2) Beta(v; alpha, beta).
#pragma once

namespace pocd {

/// l: geometric change [m]; v: stationarity score in [0, 1]. sigma, alpha, beta > 0.
struct Belief {
  double mu = 0.0;
  double sigma = 0.5;
  double alpha = 0.67;
  double beta = 0.33;

  /// E[v], the probability-like score that rules compare with thresholds.
  double stationarity() const { return alpha / (alpha + beta); }
};

}  // namespace pocd
