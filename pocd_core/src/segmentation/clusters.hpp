// Pixels that belong to one thing: connected components of the organised cloud.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/segmentation/observations.hpp"

namespace pocd {

struct Cluster {
  ClassId class_id = 0;
  std::uint16_t instance = 0;
  int pixels = 0;
  double area_m2 = 0.0;               ///< of the surface that its pixels see, as if facing them
  std::vector<std::int32_t> members;  ///< pixels, row by row
  OrientedBox box;                    ///< not set by find_clusters
  bool pieced = false;                ///< seen in pieces; not set by find_clusters
};

/// What find_clusters keeps from frame to frame, so that no memory is asked for per pixel.
struct ClusterMemory {
  struct Component {
    std::int32_t first = 0, pixels = 0;
    double area_m2 = 0.0;
    std::int32_t kept = -1;  ///< number of its cluster
  };
  // Per grid pixel.
  std::vector<std::uint32_t> key;   // class and instance
  std::vector<float> limit2;        // squared reach to neighbours; negative: no object pixel
  std::vector<std::int32_t> links;  // bits: which neighbours belong to the same thing
  std::vector<std::int32_t> run_of;
  // Per run.
  std::vector<std::int32_t> first_of, end_of;  // its pixels
  std::vector<std::int32_t> parent;            // union-find
  std::vector<std::int32_t> component;
  std::vector<Component> components;
  std::vector<std::vector<std::int32_t>> members;  // spare lists
};

/// Connected components of object pixels with one class and instance, in the order of their first
/// pixel; those smaller than `config` asks for are left out.
std::vector<Cluster> find_clusters(const OrganizedCloud& cloud, const SegmentationConfig& config,
                                   const DepthNoise& noise, ClusterMemory& memory);

}  // namespace pocd
