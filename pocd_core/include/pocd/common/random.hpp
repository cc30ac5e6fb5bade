// Seeded random numbers whose sequence does not depend on the standard library (the distributions of
// <random> may differ between implementations).
#pragma once

#include <cmath>
#include <cstdint>

namespace pocd {

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014). Not for cryptography. Not thread-safe.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform integer in [0, n), n > 0. (Bias below 2^-40 for n < 2^24.)
  std::uint64_t below(std::uint64_t n) { return next() % n; }
  /// Normal(0, 1), by the polar method of Marsaglia and Bray (1964).
  double normal() {
    double u, v, s;
    do {
      u = uniform(-1, 1), v = uniform(-1, 1), s = u * u + v * v;
    } while (s >= 1.0 || s == 0.0);
    return u * std::sqrt(-2.0 * std::log(s) / s);
  }

 private:
  std::uint64_t state_;
};

}  // namespace pocd
