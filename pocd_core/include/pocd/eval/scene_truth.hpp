// What a simulated run must be judged by, made once per scenario from exact images.
#pragma once

#include <optional>

#include "pocd/common/thread_pool.hpp"
#include "pocd/eval/place_match.hpp"
#include "pocd/eval/voxel_metrics.hpp"
#include "pocd/sim/truth.hpp"

namespace pocd {

struct SceneTruthOptions {
  double map_voxel_m = TsdfConfig{}.voxel_size_m;
  double max_depth_m = TsdfConfig{}.max_depth_m;
  /// Of the frames of the last visit for the observed region and the visible surface; counts of the
  /// region are multiplied by it.
  int frame_stride = 3;
};

/// A change of the truth and when the robots could first see it clearly. Frames are numbers within
/// the run, over all robots.
struct SeenChange {
  TruthChange change;
  /// In which it happened or, when it could not be seen there, the first later one in which it can,
  /// unless the object changes once more before.
  std::size_t visit = 1;
  /// First frame by which half of what the visit ever sees through the old place, or sees of the
  /// object in its new place, has been seen; nothing when that is less than 10 sample points (grid
  /// of two voxels of the map).
  std::optional<std::size_t> old_place_frame, new_place_frame;

  /// The frame by which a change can be known: for MOVED the later of the two that there are, since
  /// something new in sight may be an addition until the old place is seen.
  std::optional<std::size_t> clear_frame() const;
};

struct SceneTruth {
  SurfaceTruth surface;
  ObservedRegion observed;
  std::vector<SeenChange> changes;
  /// Objects in their places, per visit.
  std::vector<std::vector<TruthObject>> objects;
  /// First frame of each visit, then the number of frames.
  std::vector<std::size_t> visit_begin;
  /// See place_match.hpp.
  double place_tolerance_m = kPlaceTolerance_m;
};

SceneTruth scene_truth(const Scenario& scenario, const SceneTruthOptions& options,
                       ThreadPool* pool);

/// Distance of a point to the nearest surface of a part of the scene [m], at most `limit_m`.
double surface_distance(const Scene& scene, const Eigen::Vector3d& point_W, double limit_m);

}  // namespace pocd
