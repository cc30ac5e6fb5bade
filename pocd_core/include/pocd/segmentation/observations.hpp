// Step 3 of the method: clusters of the cleaned cloud, and the observations made of them.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/segmentation/planes.hpp"

namespace pocd {

/// A point of a surface. normal_W is a unit vector towards the side it was seen from, or zero where
/// the surface was not planar. sigma_m: depth noise at the point.
struct SurfacePoint {
  Eigen::Vector3f point_W;
  Eigen::Vector3f normal_W;
  float sigma_m = 0.0f;
  bool arrived = false;  ///< its place was seen empty before; set where that is asked
};

/// One cluster of one frame, thinned to about one point per `spacing`.
struct Observation {
  ClassId class_id = 0;
  std::uint16_t instance = 0;  ///< 0 where masks carry no instances
  OrientedBox box;
  std::vector<SurfacePoint> points;
  int pixels = 0;        ///< of the strided grid
  double area_m2 = 0.0;  ///< of the surface seen face on
  /// Share of its outline (sides and top) where the image, the depth limit or something nearer cuts
  /// it off: above about 0.1 it goes on unseen.
  double cut_share = 0.0;
  /// The same of the upper outline alone, without the depth limit: above a fifth or so, its height
  /// is not known.
  double cut_above_share = 0.0;
  /// Of a thing told by geometry: share of its left and right outline where it ends: what lies
  /// behind is seen, and is not its own plane going on. Where something nearer hides the end, it
  /// counts as one, but not of what is mostly one plane. 0: it may be a piece of a wall.
  double free_beside_share = 1.0;
};

struct Observations {
  std::vector<Observation> list;
  /// Per grid pixel: index in `list` or kNone.
  std::vector<std::int32_t> observation_of;
  static constexpr std::int32_t kNone = -1;
};

/// Connected components of kObject pixels of one class and instance (organised Euclidean
/// clustering: image neighbours, also across a gap of one pixel, nearer than the tolerance), small
/// ones dropped, overlapping ones of one class merged, one class by majority, each with box and
/// thinned points. Pixels of the ground band right under an observation and of its class are given
/// to it.
void extract_observations(const SegmentationConfig& config, const DepthNoise& noise,
                          double spacing_m, const PlaneSegmentation& planes, OrganizedCloud& cloud,
                          Observations& out);

/// Upright box around points: heading in which most upright surface normals are parallel to a side,
/// the outermost `trim` share of points per axis left out. Where normals (one per point, zero =
/// unknown) do not agree, the rectangle of least area around the points flattened to the ground
/// gives the heading; it alone would not do, since two sides of a box seen from a corner span a
/// triangle, around which several rectangles are least. Sizes of degenerate sets are 0. At least
/// one point.
OrientedBox fit_box(const Points& points_W, const Points& normals_W, double trim);

/// The published box: heading of the major axis by principal component analysis.
OrientedBox fit_box_pca(const Points& points_W);

/// Volume of the intersection over the smaller volume, with every size at least `min_size_m`.
double box_overlap(const OrientedBox& a, const OrientedBox& b, double min_size_m);

}  // namespace pocd
