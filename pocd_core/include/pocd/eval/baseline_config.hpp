// Thresholds of the methods that the pipeline is compared with, as found by `pocd_tune` on
// scenes and seeds other than those that are reported; docs/evaluation.md has the command.
#pragma once

#include "pocd/common/describe.hpp"
#include "pocd/eval/published_config.hpp"

namespace pocd {

/// Of a signed distance map.
struct VoxelWeights {
  double max_weight;
  double min_weight;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("max_weight", max_weight, Range{0.1, 1e6},
          "Cap of a voxel's weight [observations at 1 m].");
    visit("min_weight", min_weight, Range{0.0, 1e6},
          "Weight at which a voxel counts as observed [observations at 1 m].");
  }
};

/// Voxblox's cap is 10000, in effect none.
struct StaticTsdfConfig : VoxelWeights {
  StaticTsdfConfig() : VoxelWeights{5.0, 0.5} {}
};

struct VoxelCorrectionConfig {
  int max_weight = 10;
  int min_weight = 2;
  bool clear_beyond_limit = true;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("max_weight", max_weight, Range{1, 1000}, "Cap of a voxel's weight [observations].");
    visit("min_weight", min_weight, Range{1, 1000},
          "Weight at which a voxel counts as observed [observations].");
    visit("clear_beyond_limit", clear_beyond_limit,
          "Pixels beyond the depth limit show free space before it, as those of Voxblox do.");
  }
};

/// The weights are those of the static map.
struct TrackedObjectsConfig : VoxelWeights {
  TrackedObjectsConfig() : VoxelWeights{200.0, 1.0} {}

  int lost_after_frames = 150;
  bool keep_lost = false;
  int min_hits = 4;
  double overlap_share = 0.5;

  template <class Visitor>
  void describe(Visitor& visit) {
    VoxelWeights::describe(visit);
    visit("lost_after_frames", lost_after_frames, Range{1, 1000000},
          "A model that is not found for this many frames is lost [frames]; MaskFusion: 10.");
    visit("keep_lost", keep_lost, "A lost model stays where it was seen last, not given up.");
    visit("min_hits", min_hits, Range{1, 1000},
          "Frames that must have seen a point of a model for it to be reported.");
    visit("overlap_share", overlap_share, Range{0.0, 1.0},
          "Share of an observation that a model must explain to be tracked on it.");
  }
};

struct SubmapsConfig : VoxelWeights {
  SubmapsConfig() : VoxelWeights{15.0, 0.2} {}

  int inactive_after_frames = 5;
  int confirm_frames = 2;
  double same_thing_share = 0.3;
  double conflict_share = 0.3;
  double match_share = 0.3;
  double compared_share = 0.1;
  double margin_voxels = 3.0;

  template <class Visitor>
  void describe(Visitor& visit) {
    VoxelWeights::describe(visit);
    visit("inactive_after_frames", inactive_after_frames, Range{1, 1000000},
          "A submap that is not observed for this many frames is frozen [frames].");
    visit("confirm_frames", confirm_frames, Range{1, 1000},
          "Frames that must have observed a submap for it to be kept.");
    visit("same_thing_share", same_thing_share, Range{0.0, 1.0},
          "Share of an observation that an active submap must explain to take it.");
    visit("conflict_share", conflict_share, Range{0.0, 1.0},
          "A frozen submap is discarded when more of its compared points are seen through.");
    visit("match_share", match_share, Range{0.0, 1.0},
          "A new submap is merged into a frozen one that agrees with more of it.");
    visit("compared_share", compared_share, Range{0.0, 1.0},
          "Share of a submap's points to be compared before anything is decided.");
    visit("margin_voxels", margin_voxels, Range{0.1, 20.0},
          "Depth beyond a point by more than this conflicts, within it matches [voxels].");
  }
};

struct BaselineConfig {
  PublishedConfig published;
  StaticTsdfConfig static_tsdf;
  VoxelCorrectionConfig voxel_correction;
  TrackedObjectsConfig tracked_objects;
  SubmapsConfig submaps;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.group("published", published, "The method as its authors published it.");
    visit.group("static_tsdf", static_tsdf, "Static world.");
    visit.group("voxel_correction", voxel_correction, "Correction voxel by voxel.");
    visit.group("tracked_objects", tracked_objects, "Tracked dynamic objects.");
    visit.group("submaps", submaps, "Object submaps with consistency checks.");
  }
};

}  // namespace pocd
