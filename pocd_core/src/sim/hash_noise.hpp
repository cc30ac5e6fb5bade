// Repeatable noise addressed by integers: the same numbers whatever the order of evaluation.
#pragma once

#include <cmath>
#include <cstdint>

#include "pocd/common/random.hpp"

namespace pocd {

/// Mixes integers to 64 well-spread bits (SplitMix64 finaliser, chained).
inline std::uint64_t hash_of(std::uint64_t a, std::uint64_t b, std::uint64_t c = 0,
                             std::uint64_t d = 0) {
  std::uint64_t h = Random(a ^ 0x5851F42D4C957F2Dull).next();
  h = Random(h ^ b).next();
  h = Random(h ^ c).next();
  return Random(h ^ d).next();
}

/// Uniform in [0, 1) from hash bits.
inline double unit_of(std::uint64_t hash) { return static_cast<double>(hash >> 11) * 0x1.0p-53; }

/// Close to Normal(0, 1), limited to +-3.46: the sum of the hash's four 16-bit pieces (Irwin-Hall),
/// scaled to unit variance. Four times faster than an exact one; depth noise needs no far tails.
inline float normal_of(std::uint64_t hash) {
  const std::uint32_t sum = static_cast<std::uint32_t>(hash & 0xFFFF) +
                            static_cast<std::uint32_t>((hash >> 16) & 0xFFFF) +
                            static_cast<std::uint32_t>((hash >> 32) & 0xFFFF) +
                            static_cast<std::uint32_t>(hash >> 48);
  // Four uniforms on {0 .. 65535}: mean 2 * 65535, variance 4 * (65536^2 - 1) / 12.
  constexpr float kInverseSigma = 1.0f / 37837.227f;
  return (static_cast<float>(sum) - 131070.0f) * kInverseSigma;
}

/// Smooth in x, in [-1, 1], equal to a hashed value at every integer x.
inline double smooth_noise(std::uint64_t seed, std::uint64_t channel, double x) {
  const double cell = std::floor(x);
  const double t = x - cell;
  const auto knot = [&](double at) {
    return 2.0 * unit_of(hash_of(seed, channel,
                                 static_cast<std::uint64_t>(static_cast<std::int64_t>(at)))) -
           1.0;
  };
  const double blend = t * t * (3.0 - 2.0 * t);
  return knot(cell) * (1.0 - blend) + knot(cell + 1.0) * blend;
}

}  // namespace pocd
