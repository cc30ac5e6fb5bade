// The belief about one object: q(l, v) = Normal(l; mu, sigma^2) Beta(v; alpha, beta).
#pragma once

namespace pocd {

/// What is believed of a new object, unless the configuration says otherwise.
constexpr double kInitialStationarity = 0.67;  ///< E[v]
constexpr double kInitialCount = 3.0;          ///< alpha + beta
constexpr double kInitialSigma_m = 0.5;

/// l: geometric change [m]; v: stationarity score in [0, 1]. sigma, alpha, beta > 0.
struct Belief {
  double mu = 0.0;
  double sigma = kInitialSigma_m;
  double alpha = kInitialStationarity * kInitialCount;
  double beta = (1.0 - kInitialStationarity) * kInitialCount;

  /// E[v], the probability-like score that rules compare with thresholds.
  double stationarity() const { return alpha / (alpha + beta); }
};

}  // namespace pocd
