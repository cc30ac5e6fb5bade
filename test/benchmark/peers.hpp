// What others offer for a stage, on the same frames. All of them run on one thread.
#pragma once

#include <memory>
#include <vector>

#include "found_objects.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd::bench {

struct OrientedPoints {
  Points points_W, normals_W;
};

/// cv::kinfu's hash TSDF, OpenCL off, with the same voxel size, truncation, weight and depth limit.
/// It keeps no owners. Only where OpenCV has the rgbd module (contrib).
class HashTsdf {
 public:
  explicit HashTsdf(const TsdfConfig& config);
  ~HashTsdf();
  static bool available();
  void integrate(const Frame& frame);
  /// Its surface as far as these frames' pixels see it, the mean of what they see per voxel: by
  /// raycast(), since fetchPointsNormals() gives every voxel that was observed, not those at the
  /// surface. raycast() reads the voxel below a point instead of the nearest: rays begin half a
  /// voxel higher to make up for it.
  OrientedPoints surface(const std::vector<Frame>& frames) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The points of a grid within the depth limit, as PCL wants them; made outside of the timing.
class PclFrame {
 public:
  explicit PclFrame(const OrganizedCloud& cloud);
  ~PclFrame();
  /// The textbook: voxel grid, largest plane by RANSAC taken away, Euclidean clusters of the rest.
  /// Returns the number of clusters.
  std::size_t clean_and_cluster(double leaf_m, double plane_m, double tolerance_m) const;
  /// The same, as the cluster of each pixel of the cloud that this was made of.
  Clusters clusters(const OrganizedCloud& cloud, double leaf_m, double plane_m,
                    double tolerance_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// OpenCV's depthTo3d for the points of a frame.
cv::Mat opencv_points(const Frame& frame);
/// OpenCV's plane finder (cv::rgbd, normals computed before); returns the number of planes.
int opencv_planes(const Frame& frame, const cv::Mat& points, const cv::Mat& normals);
cv::Mat opencv_normals(const Frame& frame, const cv::Mat& points);
/// Components of the depth image cut at depth steps of `step_m`; returns their number.
int opencv_components(const Frame& frame, double max_depth_m, double step_m);

}  // namespace pocd::bench
