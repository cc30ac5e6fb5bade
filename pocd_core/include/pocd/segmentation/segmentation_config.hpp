// Parameters of the way from a frame to observations.
#pragma once

#include "pocd/common/describe.hpp"

namespace pocd {

/// Of a robot that sends no masks: what makes one thing of pieces, and a thing of a piece. Shares,
/// so that they hold at any scale and distance; lengths are those of the segmentation and of the
/// noise.
struct ThingsConfig {
  double behind_share = 0.25;
  double rim_share = 0.6;
  double side_share = 0.03;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit(
        "behind_share", behind_share, Range{0.05, 1.0},
        "Two pieces are one thing when, along this share of the smaller one's height or width, the "
        "plane of each goes on in the other behind something nearer. A quarter: small pieces have "
        "few pixels whose plane is known.");
    visit(
        "rim_share", rim_share, Range{0.05, 1.0},
        "Two pieces are one open container when one is seen over the upper edge of the other along "
        "this share of the wider one. More than half: a thing behind another one seldom has its "
        "width and its height.");
    visit("side_share", side_share, Range{0.0, 1.0},
          "A thing is reported once this share of its left and right outline was seen to be its "
          "end, in one look; a piece of a wall has none. Not 0: outlines are ragged.");
  }
};

struct SegmentationConfig {
  int stride = 2;
  double plane_max_angle_deg = 12.0;
  double plane_tolerance_m = 0.03;
  double majority_share = 0.65;
  double ground_band_m = 0.06;
  double ground_max_tilt_deg = 10.0;
  double ground_min_share = 0.02;
  double cluster_tolerance_m = 0.10;
  double min_cluster_area_m2 = 0.02;
  int min_cluster_pixels = 40;
  double max_height_m = 2.6;
  ThingsConfig things;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("stride", stride, Range{1, 8},
          "Every n-th pixel of every n-th row is segmented and clustered [pixels].");
    visit("plane_max_angle_deg", plane_max_angle_deg, Range{1, 45},
          "Neighbouring planar cells whose normals differ by less grow into one plane [deg].");
    visit("plane_tolerance_m", plane_tolerance_m, Range{0.001, 0.5},
          "Distance to a plane, added to three sigma of the depth noise, that still counts as on "
          "it [m].");
    visit("majority_share", majority_share, Range{0.5, 1.0},
          "Share of a plane's or a cluster's pixels from which its most frequent class is given to "
          "all.");
    visit("ground_band_m", ground_band_m, Range{0.0, 0.5},
          "Points up to this height above the ground plane, and all below it, are ground [m].");
    visit("ground_max_tilt_deg", ground_max_tilt_deg, Range{0.5, 45},
          "Largest angle between a ground plane's normal and up [deg].");
    visit("ground_min_share", ground_min_share, Range{0.001, 1.0},
          "Share of a frame's points a plane needs to be taken as the ground.");
    visit("cluster_tolerance_m", cluster_tolerance_m, Range{0.001, 2.0},
          "Largest gap between neighbouring points of one cluster [m].");
    visit("min_cluster_area_m2", min_cluster_area_m2, Range{0.0, 10.0},
          "Clusters with less visible surface, seen face on, are dropped [m2].");
    visit("min_cluster_pixels", min_cluster_pixels, Range{3, 100000},
          "Clusters with fewer pixels (after the stride) are dropped.");
    visit("max_height_m", max_height_m, Range{0.1, 100.0},
          "Points higher above the ground than this are background [m].");
    visit.group("things", things,
                "Telling things by geometry: pieces of one thing where masks carry no instances, "
                "and what is "
                "a thing where there are no masks.");
  }
};

}  // namespace pocd
