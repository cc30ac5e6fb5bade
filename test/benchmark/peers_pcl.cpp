#include <pcl/filters/extract_indices.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include "peers.hpp"

namespace pocd::bench {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

struct PclFrame::Impl {
  Cloud::Ptr cloud = pcl::make_shared<Cloud>();
};

PclFrame::PclFrame(const OrganizedCloud& cloud) : impl_(std::make_unique<Impl>()) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.kind[i] == PixelKind::kNone) continue;
    impl_->cloud->push_back({cloud.x_W[i], cloud.y_W[i], cloud.z_W[i]});
  }
}
PclFrame::~PclFrame() = default;

std::size_t PclFrame::clean_and_cluster(double leaf_m, double plane_m, double tolerance_m) const {
  if (impl_->cloud->empty()) return 0;
  const auto thinned = pcl::make_shared<Cloud>();
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(impl_->cloud);
  grid.setLeafSize(static_cast<float>(leaf_m), static_cast<float>(leaf_m),
                   static_cast<float>(leaf_m));
  grid.filter(*thinned);

  pcl::SACSegmentation<pcl::PointXYZ> ransac;
  ransac.setOptimizeCoefficients(true);
  ransac.setModelType(pcl::SACMODEL_PLANE);
  ransac.setMethodType(pcl::SAC_RANSAC);
  ransac.setMaxIterations(100);
  ransac.setDistanceThreshold(plane_m);
  ransac.setInputCloud(thinned);
  const auto inliers = pcl::make_shared<pcl::PointIndices>();
  pcl::ModelCoefficients plane;
  ransac.segment(*inliers, plane);
  const auto rest = pcl::make_shared<Cloud>();
  pcl::ExtractIndices<pcl::PointXYZ> extract;
  extract.setInputCloud(thinned);
  extract.setIndices(inliers);
  extract.setNegative(true);
  extract.filter(*rest);
  if (rest->empty()) return 0;

  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  tree->setInputCloud(rest);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> clusters;
  clusters.setClusterTolerance(tolerance_m);
  clusters.setMinClusterSize(20);
  clusters.setSearchMethod(tree);
  clusters.setInputCloud(rest);
  std::vector<pcl::PointIndices> found;
  clusters.extract(found);
  return found.size();
}

}  // namespace pocd::bench
