// What the quick ways to clusters find: objects of the truth that come out as one cluster.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/segmentation/organized_cloud.hpp"
#include "pocd/segmentation/segmentation_config.hpp"

namespace pocd::bench {

/// Number of a cluster for every pixel of a cloud, kNoCluster for the rest.
using Clusters = std::vector<std::int32_t>;
constexpr std::int32_t kNoCluster = -1;

/// For every pixel the true object in whose box it lies (above the ground band), kNoCluster
/// elsewhere.
Clusters true_clusters(const OrganizedCloud& cloud, const std::vector<OrientedBox>& objects,
                       const SegmentationConfig& config);

struct FoundObjects {
  int in_sight = 0;  ///< with at least the pixels that a cluster must have
  int found = 0;     ///< one cluster has half of the object's pixels, which are half of its own
  void add(const Clusters& truth, const Clusters& clusters, int least_pixels);
};

}  // namespace pocd::bench
