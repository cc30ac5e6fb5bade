// The belief about one object: q(l, v) = Normal(l; mu, sigma^2) Beta(v; alpha, beta).
#pragma once

namespace pocd {

/// l: geometric change [m]; v: stationarity score in [0, 1]. sigma, alpha, beta > 0.
/// A new one is that of StateConfig's defaults.
struct Belief {
  double mu = 0.0;
  double sigma = 0.5;
  double alpha = 2.01;
  double beta = 0.99;

  /// E[v], the probability-like score that rules compare with thresholds.
  double stationarity() const { return alpha / (alpha + beta); }
};

}  // namespace pocd
