#include <pcl/filters/extract_indices.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <unordered_map>

#include "peers.hpp"
#include "pocd/map/voxel_block.hpp"

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

namespace {

struct Found {
  Cloud::Ptr points = pcl::make_shared<Cloud>();  // without the plane
  std::vector<pcl::PointIndices> clusters;
};

Found find_clusters(const Cloud::ConstPtr& cloud, double leaf_m, double plane_m,
                    double tolerance_m) {
  Found found;
  if (cloud->empty()) return found;
  const auto thinned = pcl::make_shared<Cloud>();
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(cloud);
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
  pcl::ExtractIndices<pcl::PointXYZ> extract;
  extract.setInputCloud(thinned);
  extract.setIndices(inliers);
  extract.setNegative(true);
  extract.filter(*found.points);
  if (found.points->empty()) return found;

  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  tree->setInputCloud(found.points);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> clusters;
  clusters.setClusterTolerance(tolerance_m);
  clusters.setMinClusterSize(20);
  clusters.setSearchMethod(tree);
  clusters.setInputCloud(found.points);
  clusters.extract(found.clusters);
  return found;
}

}  // namespace

std::size_t PclFrame::clean_and_cluster(double leaf_m, double plane_m, double tolerance_m) const {
  return find_clusters(impl_->cloud, leaf_m, plane_m, tolerance_m).clusters.size();
}

Clusters PclFrame::clusters(const OrganizedCloud& cloud, double leaf_m, double plane_m,
                            double tolerance_m) const {
  const Found found = find_clusters(impl_->cloud, leaf_m, plane_m, tolerance_m);
  // A point of the grid is the mean of its cell's pixels, and lies in that cell.
  const auto cell = [&](const Eigen::Vector3f& p) {
    const Eigen::Vector3f c = (p / static_cast<float>(leaf_m)).array().floor();
    return BlockKey{static_cast<int>(c.x()), static_cast<int>(c.y()), static_cast<int>(c.z())};
  };
  std::unordered_map<BlockKey, std::int32_t, BlockKeyHash> cluster_of;
  for (std::size_t n = 0; n < found.clusters.size(); ++n) {
    for (const int i : found.clusters[n].indices) {
      cluster_of[cell((*found.points)[static_cast<std::size_t>(i)].getVector3fMap())] =
          static_cast<std::int32_t>(n);
    }
  }
  Clusters clusters(cloud.size(), kNoCluster);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.kind[i] == PixelKind::kNone) continue;
    const auto it = cluster_of.find(cell(cloud.point_W(i)));
    if (it != cluster_of.end()) clusters[i] = it->second;
  }
  return clusters;
}

}  // namespace pocd::bench
