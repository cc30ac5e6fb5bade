// Parameters of the method as its authors published it (Qian et al., RSS 2022); the defaults are
// those of their warehouse. What they share with every method, the map and the segmentation, is in
// PipelineConfig: theta_depth is map.max_depth_m.
#pragma once

#include "pocd/common/describe.hpp"

namespace pocd {

struct PublishedConfig {
  double max_distance_m = 0.9;
  double max_dissimilarity = 0.10;
  double cutoff_cost = 3.6;
  double lambda_translation = 1.0;
  double lambda_rotation = 1.0;
  double lambda_class = 1000.0;
  double min_frustum_share = 0.20;
  double lambda_diff = 1.6;
  double delta_max_m = 4.0;
  double tau_m = 0.20;
  double initial_stationarity = 0.67;
  double initial_sigma_m = 0.5;
  double max_stationarity = 0.9999;
  double remove_below = 0.4;
  double k = 3.0;
  // The paper gives no value for these.
  double initial_count = 3.0;
  double max_count = 12.0;
  double tsdf_truncation_m = 0.8;
  int icp_points = 600;
  int icp_iterations = 30;
  double icp_max_distance_m = 0.5;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("max_distance_m", max_distance_m, Range{0.01, 100.0},
          "Objects and observations whose centres are this far apart are no pair, theta_dist [m].");
    visit("max_dissimilarity", max_dissimilarity, Range{0.0, 1.0},
          "Largest share of outliers after ICP, theta_sim.");
    visit("cutoff_cost", cutoff_cost, Range{1e-6, 1e6},
          "Pairs that cost more are no pair, theta_cutoff.");
    visit("lambda_translation", lambda_translation, Range{0.0, 1e6},
          "Cost per metre of translation, lambda1 [1/m].");
    visit("lambda_rotation", lambda_rotation, Range{0.0, 1e6},
          "Cost per radian of rotation, lambda2 [1/rad].");
    visit("lambda_class", lambda_class, Range{0.0, 1e9}, "Cost of two different classes, lambda3.");
    visit("min_frustum_share", min_frustum_share, Range{0.0, 1.0},
          "An object with this share of its points in the frustum and no observation is "
          "unobserved, theta_vis.");
    visit("lambda_diff", lambda_diff, Range{0.0, 100.0}, "Scale of the geometric change.");
    visit("delta_max_m", delta_max_m, Range{0.01, 100.0},
          "Largest change, and that of an unobserved object, Delta_max [m].");
    visit("tau_m", tau_m, Range{0.001, 10.0},
          "Standard deviation of a measured change; changes up to half of it verify an "
          "observation, tau [m].");
    visit("initial_stationarity", initial_stationarity, Range{0.01, 0.99}, "E[v] of a new object.");
    visit("initial_sigma_m", initial_sigma_m, Range{0.001, 100.0}, "sigma of a new object [m].");
    visit("max_stationarity", max_stationarity, Range{0.5, 1.0},
          "An update that would raise E[v] above this is not applied, v_max.");
    visit("remove_below", remove_below, Range{0.0, 1.0},
          "Objects with E[v] below this are erased, theta_stat.");
    visit("k", k, Range{0.0, 100.0},
          "Weight of the stationarity class where it supports the measurement.");
    visit("initial_count", initial_count, Range{0.1, 1000.0}, "alpha + beta of a new object.");
    visit("max_count", max_count, Range{1.0, 1e6}, "Cap of alpha + beta.");
    visit("tsdf_truncation_m", tsdf_truncation_m, Range{0.01, 10.0},
          "Truncation of the two TSDFs of the geometric change [m].");
    visit("icp_points", icp_points, Range{20, 100000}, "Points of an observation used by ICP.");
    visit("icp_iterations", icp_iterations, Range{1, 200}, "Iterations of ICP.");
    visit("icp_max_distance_m", icp_max_distance_m, Range{0.001, 10.0},
          "Pairs of points farther apart are not used by ICP [m].");
  }
};

}  // namespace pocd
