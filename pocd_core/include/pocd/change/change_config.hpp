// Parameters of measuring geometric change.
#pragma once

#include "pocd/config/words.hpp"

namespace pocd {

enum class ChangeMeasure { kProjective, kRayTraced };

struct ChangeConfig {
  ChangeMeasure measure = ChangeMeasure::kProjective;
  double lambda_diff = 1.6;
  double delta_max_m = 4.0;
  double tau_m = 0.20;
  double depth_noise_factor = 0.0;
  double pose_tolerance_m = 0.03;
  double tsdf_truncation_m = 0.8;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("measure", measure,
          Words<ChangeMeasure>{{{ChangeMeasure::kProjective, "projective"},
                                {ChangeMeasure::kRayTraced, "ray_traced"}}},
          "projective: median difference of depth over the object's points that the frame sees; "
          "ray_traced: mean difference of two TSDFs, as published.");
    visit("lambda_diff", lambda_diff, Range{0.0, 100.0}, "Scale of the ray-traced measure.");
    visit("delta_max_m", delta_max_m, Range{0.01, 100.0},
          "Largest change, and the pseudo-change of an object that is not there any more, "
          "Delta_max [m].");
    visit(
        "tau_m", tau_m, Range{0.001, 10.0},
        "Standard deviation of a measured change; changes up to half of it verify an object [m].");
    visit(
        "depth_noise_factor", depth_noise_factor, Range{0.0, 100.0},
        "Adds so many times the depth noise at the object's distance to that deviation, as a root "
        "of squares; 0: it is the same at every distance, as published.");
    visit("pose_tolerance_m", pose_tolerance_m, Range{0.0, 1.0},
          "Sideways error of poses: rays that pass nearer to a closer surface see through nothing "
          "[m].");
    visit("tsdf_truncation_m", tsdf_truncation_m, Range{0.01, 10.0},
          "Truncation of the two TSDFs of the ray-traced measure [m].");
  }
};

}  // namespace pocd
