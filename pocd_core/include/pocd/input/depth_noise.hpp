// Standard deviation of a depth measurement as a function of its depth.
#pragma once

#include "pocd/common/describe.hpp"

namespace pocd {

/// sigma(z) = base + quadratic * z^2, the usual stereo model (Khoshelham and Elberink, Sensors
/// 2012).
struct DepthNoise {
  double base_m = 0.004;
  double quadratic_per_m = 0.003;

  double sigma(double z_m) const { return base_m + quadratic_per_m * z_m * z_m; }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("base_m", base_m, Range{0.0, 0.2}, "Depth noise at zero range, one sigma [m].");
    visit("quadratic_per_m", quadratic_per_m, Range{0.0, 0.1},
          "Growth of the depth noise with the square of the range, one sigma [1/m].");
  }
};

}  // namespace pocd
