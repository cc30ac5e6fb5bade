// Rounding in inner loops.
#pragma once

namespace pocd {

/// std::lround of a float that fits into an int, without the call: in double the sum with one half
/// is exact.
inline int round_to_int(float value) {
  const double v = value;
  return static_cast<int>(v < 0.0 ? v - 0.5 : v + 0.5);
}

}  // namespace pocd
