// Parameters of the association of observations with objects.
#pragma once

#include "pocd/common/describe.hpp"

namespace pocd {

struct AssociationConfig {
  double max_distance_m = 0.9;
  double max_dissimilarity = 0.10;
  double min_visible_share = 0.10;
  int icp_points = 600;
  int icp_iterations = 30;
  double icp_max_distance_m = 0.5;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("max_distance_m", max_distance_m, Range{0.01, 100.0},
          "Longest motion by which a thing is found beside its place; what stands farther off is "
          "another thing until its old place is seen empty, theta_dist [m].");
    visit(
        "max_dissimilarity", max_dissimilarity, Range{0.0, 1.0},
        "Largest share of outliers with which the method tracked_objects of pocd_evaluate takes a "
        "thing to be where it was, theta_sim. The pipeline does not use it.");
    visit(
        "min_visible_share", min_visible_share, Range{0.0, 1.0},
        "Share of an object's points that a frame must measure at another place for the object to "
        "have moved there.");
    visit("icp_points", icp_points, Range{20, 100000}, "Points of an observation used by ICP.");
    visit("icp_iterations", icp_iterations, Range{1, 200}, "Iterations of ICP.");
    visit("icp_max_distance_m", icp_max_distance_m, Range{0.001, 10.0},
          "Pairs of points farther apart are not used by ICP; what stands farther before a thing "
          "has not taken its place [m].");
  }
};

}  // namespace pocd
