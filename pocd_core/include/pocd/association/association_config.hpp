// Parameters of the association of observations with objects.
#pragma once

#include "pocd/config/describe.hpp"

namespace pocd {

struct AssociationConfig {
  double max_distance_m = 0.9;
  double max_dissimilarity = 0.10;
  double cutoff_cost = 3.6;
  double lambda_translation = 1.0;
  double lambda_rotation = 1.0;
  double lambda_class = 1000.0;
  double min_visible_share = 0.20;
  bool occlusion_aware = true;
  bool realign_displaced = true;
  bool grow_by_pieces = true;
  int icp_points = 600;
  int icp_iterations = 30;
  double icp_max_distance_m = 0.5;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit(
        "max_distance_m", max_distance_m, Range{0.01, 100.0},
        "Objects and observations whose boxes' centres are farther apart are no pair, unless their "
        "boxes overlap, theta_dist [m].");
    visit("max_dissimilarity", max_dissimilarity, Range{0.0, 1.0},
          "Largest share of outliers after ICP, theta_sim.");
    visit("cutoff_cost", cutoff_cost, Range{1e-6, 1e6},
          "Pairs that cost more are no pair, theta_cutoff.");
    visit("lambda_translation", lambda_translation, Range{0.0, 1e6},
          "Cost per metre of translation [1/m].");
    visit("lambda_rotation", lambda_rotation, Range{0.0, 1e6},
          "Cost per radian of rotation [1/rad].");
    visit("lambda_class", lambda_class, Range{0.0, 1e9}, "Cost of two different classes.");
    visit("min_visible_share", min_visible_share, Range{0.0, 1.0},
          "Share of an object's points that a frame must see, or see through, before the absence "
          "of an "
          "observation says anything, theta_vis.");
    visit("occlusion_aware", occlusion_aware,
          "Only what the camera sees through is evidence of absence; false: an object in the "
          "frustum without an observation is taken as gone, as published.");
    visit("realign_displaced", realign_displaced,
          "Align a known object anew where much of what is seen of it is off; false: such an "
          "observation is judged by the measured change alone, as published.");
    visit("grow_by_pieces", grow_by_pieces,
          "A second observation that fits a known object in part is another piece of it; false: it "
          "becomes an object of its own, as published.");
    visit("icp_points", icp_points, Range{20, 100000}, "Points of an observation used by ICP.");
    visit("icp_iterations", icp_iterations, Range{1, 200}, "Iterations of ICP.");
    visit("icp_max_distance_m", icp_max_distance_m, Range{0.001, 10.0},
          "Pairs of points farther apart are not used by ICP [m].");
  }
};

}  // namespace pocd
