// Small corrections of a frame's pose from the objects that stand still.
#pragma once

#include <optional>

#include "pocd/common/describe.hpp"
#include "pocd/input/depth_noise.hpp"
#include "pocd/objects/object_library.hpp"

namespace pocd {

struct PoseRefinementConfig {
  bool enabled = true;
  double sigma_position_m = 0.03;
  double sigma_heading_deg = 0.4;
  double max_correction_m = 0.10;
  double max_correction_deg = 1.5;
  int min_points = 150;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("enabled", enabled, "Align each frame with the known objects before anything is judged.");
    visit("sigma_position_m", sigma_position_m, Range{0.0001, 10.0},
          "How far given positions are off, one sigma per horizontal axis; a third of it in height "
          "[m].");
    visit("sigma_heading_deg", sigma_heading_deg, Range{0.001, 90.0},
          "How far given headings are off, one sigma [deg].");
    visit("max_correction_m", max_correction_m, Range{0.0, 10.0},
          "Larger corrections are not believed, and not applied [m].");
    visit("max_correction_deg", max_correction_deg, Range{0.0, 90.0},
          "Larger corrections are not believed, and not applied [deg].");
    visit("min_points", min_points, Range{10, 1000000},
          "Points of known objects that a frame must measure for a correction.");
  }
};

/// The rigid motion (translation and heading) to be applied in the world, T_W_W, that brings the
/// frame onto the confirmed objects in view: Gauss-Newton on projective point-to-plane distances
/// with Tukey weights, so that what has moved does not pull, and with the given pose as prior, so
/// that what the surfaces leave open stays as given. Nothing when too little is in view, most of it
/// disagrees, or the correction is too large to be believed.
std::optional<Pose> refine_pose(const OrganizedCloud& cloud, const ObjectLibrary& library,
                                double max_depth_m, const DepthNoise& noise,
                                const PoseRefinementConfig& config);

/// Applies the correction to pose and points.
void apply_correction(const Pose& T_W_W, OrganizedCloud& cloud);

}  // namespace pocd
