// Parameters of measuring geometric change.
#pragma once

#include "pocd/common/describe.hpp"

namespace pocd {

struct ChangeConfig {
  double delta_max_m = 4.0;
  double tau_m = 0.20;
  double depth_noise_factor = 0.0;
  double pose_tolerance_m = 0.03;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("delta_max_m", delta_max_m, Range{0.01, 100.0},
          "Largest change, and the pseudo-change of an object that is not there any more, "
          "Delta_max [m].");
    visit("tau_m", tau_m, Range{0.001, 10.0},
          "Standard deviation of a measured change. A thing found again has moved from half of it "
          "on, and a box that has changed by more is reported [m].");
    visit(
        "depth_noise_factor", depth_noise_factor, Range{0.0, 100.0},
        "Adds so many times the depth noise at the object's distance to that deviation, as a root "
        "of squares; 0: it is the same at every distance, as published.");
    visit("pose_tolerance_m", pose_tolerance_m, Range{0.0, 1.0},
          "Sideways error of poses: rays that pass nearer to a closer surface see through nothing "
          "[m].");
  }
};

}  // namespace pocd
