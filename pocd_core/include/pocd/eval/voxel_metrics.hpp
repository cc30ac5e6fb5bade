// Precision, recall and false-positive rate of a map, voxel by voxel: as the paper measures them,
// and against the exact truth of a simulated place. docs/evaluation.md defines every count.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "pocd/eval/observed_region.hpp"
#include "pocd/map/tsdf_map.hpp"

namespace pocd {

struct VoxelMetricsConfig {
  double voxel_size_m = 0.2;  ///< voxels that are compared (paper: 20 cm TorWIC, 6 cm ToyCar)
  double map_voxel_m = TsdfConfig{}.voxel_size_m;  ///< of the maps; voxel_size_m is a multiple
  /// Voxels begin at multiples of voxel_size_m plus this; a multiple of map_voxel_m. Walls like to
  /// stand at round coordinates, where noise alone would decide which of two voxels they are in.
  double offset_m = TsdfConfig{}.voxel_size_m;
  /// Surface below (the floor) and above is not judged.
  double min_height_m = 0.1, max_height_m = 4.0;
  int min_points = 3;         ///< surface points that make a voxel occupied
  /// Between a surface and the truth; one voxel of the map.
  double tolerance_m = TsdfConfig{}.voxel_size_m;
  /// Frames of the last visit that must have seen, or seen through, a voxel for it to be judged.
  int min_frames = 3;
};

struct VoxelIndex {
  std::int32_t x = 0, y = 0, z = 0;
  bool operator==(const VoxelIndex& o) const { return x == o.x && y == o.y && z == o.z; }
  bool operator<(const VoxelIndex& o) const {
    return z != o.z ? z < o.z : y != o.y ? y < o.y : x < o.x;
  }
};

enum class VoxelVerdict : std::uint8_t { kTruePositive, kFalsePositive, kFalseNegative };

struct VoxelScore {
  std::int64_t true_positives = 0, false_positives = 0, false_negatives = 0, true_negatives = 0;
  /// Voxels to be found that were found. Against a reference these are the true positives; against
  /// the truth not: a true surface point in the voxel beside the one to be found is right, and
  /// finds it.
  std::int64_t recalled = 0;
  /// In percent; NaN when nothing was to be found or was found.
  double precision() const;
  double recall() const;
  double false_positive_rate() const;
  /// For pictures: every voxel that is not a true negative.
  std::map<VoxelIndex, VoxelVerdict> voxels;
};

/// Voxels that hold at least min_points of the points within the height limits, with their counts.
std::map<VoxelIndex, int> occupied_voxels(const Points& points_W, const VoxelMetricsConfig& config);

/// The paper's measure: `reference` is the surface of the map made of the last visit alone, by the
/// same method. Overlapping occupied voxels are true, the others false; true negatives are the
/// other voxels of which the last visit saw through at least half.
VoxelScore score_against_reference(const Points& map_W, const Points& reference_W,
                                   const ObservedRegion& observed,
                                   const VoxelMetricsConfig& config);

/// Truth of a place, as score_against_truth needs it.
struct SurfaceTruth {
  /// Distance of a point to the nearest true surface of the place at the end [m]; any surface, also
  /// what no camera saw.
  std::function<double(const Eigen::Vector3d& point_W)> distance_m;
  /// Voxels of map_voxel_m with surface that the last visit could see: what a map must hold.
  std::vector<VoxelIndex> visible;
};

/// Against the truth. Only points in voxels that the last visit saw or saw through are judged: a
/// voxel with at least min_points of them is true when some true surface lies within the tolerance
/// of it, else false. To be found: voxels with at least min_points visible ones of map_voxel_m;
/// found when at least half of those hold a surface point of the map or are next to one that does.
/// True negatives: voxels of which at least half was seen through, without true surface within the
/// tolerance and without false positive.
VoxelScore score_against_truth(const Points& map_W, const SurfaceTruth& truth,
                               const ObservedRegion& observed, const VoxelMetricsConfig& config);

}  // namespace pocd
