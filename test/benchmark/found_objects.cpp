#include "found_objects.hpp"

#include <map>

namespace pocd::bench {

Clusters true_clusters(const OrganizedCloud& cloud, const std::vector<OrientedBox>& objects,
                       const SegmentationConfig& config) {
  Clusters truth(cloud.size(), kNoCluster);
  const double margin = config.plane_tolerance_m;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    const OrientedBox& box = objects[n];
    const Eigen::Vector3d half = 0.5 * box.size_m;
    const Eigen::Rotation2Dd turn(-box.pose.yaw_rad);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (cloud.kind[i] == PixelKind::kNone || truth[i] != kNoCluster) continue;
      const Eigen::Vector3d p = cloud.point_W(i).cast<double>() - box.pose.position_W;
      const Eigen::Vector2d flat = turn * p.head<2>();
      if (std::abs(flat.x()) > half.x() + margin || std::abs(flat.y()) > half.y() + margin ||
          p.z() > half.z() + margin || p.z() < config.ground_band_m - half.z()) {
        continue;
      }
      truth[i] = static_cast<std::int32_t>(n);
    }
  }
  return truth;
}

void FoundObjects::add(const Clusters& truth, const Clusters& clusters, int least_pixels) {
  std::map<std::int32_t, int> of_object, of_cluster;
  std::map<std::pair<std::int32_t, std::int32_t>, int> of_both;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] != kNoCluster) ++of_object[truth[i]];
    if (clusters[i] != kNoCluster) ++of_cluster[clusters[i]];
    if (truth[i] != kNoCluster && clusters[i] != kNoCluster) ++of_both[{truth[i], clusters[i]}];
  }
  for (const auto& [object, pixels] : of_object) in_sight += pixels >= least_pixels;
  for (const auto& [pair, pixels] : of_both) {
    const int whole = of_object[pair.first];
    if (whole < least_pixels) continue;
    found += 2 * pixels > whole && 2 * pixels > of_cluster[pair.second];
  }
}

}  // namespace pocd::bench
