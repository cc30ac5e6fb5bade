// Parameters of the map.
#pragma once

#include "pocd/common/describe.hpp"
#include "pocd/map/map_memory.hpp"

namespace pocd {

struct TsdfConfig {
  double voxel_size_m = 0.05;
  double truncation_voxels = 4.0;
  double max_depth_m = 3.0;
  bool clear_beyond_limit = false;
  int max_weight = 100;
  int min_publish_weight = 1;
  MapMemoryConfig memory;

  double truncation_m() const { return truncation_voxels * voxel_size_m; }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("voxel_size_m", voxel_size_m, Range{0.002, 1.0}, "Edge of a voxel [m].");
    visit("truncation_voxels", truncation_voxels, Range{2.0, 16.0},
          "Truncation distance of the signed distance [voxels].");
    visit("max_depth_m", max_depth_m, Range{0.1, 100.0},
          "Depth beyond which a pixel is not used, theta_depth [m].");
    visit("clear_beyond_limit", clear_beyond_limit,
          "A pixel beyond max_depth_m still shows that all before that depth is free.");
    visit("max_weight", max_weight, Range{1, 1000},
          "Cap of a voxel's weight [observations]: smaller reacts faster, larger averages longer.");
    visit("min_publish_weight", min_publish_weight, Range{1, 1000},
          "Weight at which a voxel counts as observed in published tiles [observations].");
    visit.group("memory", memory, "How much memory the voxels may take.");
  }
};

}  // namespace pocd
