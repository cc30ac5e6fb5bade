#include "pocd/eval/voxel_metrics.hpp"

#include <cmath>
#include <limits>
#include <set>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

double percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

std::int32_t cell(double coordinate_m, double size_m) {
  return static_cast<std::int32_t>(std::floor(coordinate_m / size_m));
}

VoxelIndex voxel_of(const Eigen::Vector3d& p, double size_m, double offset_m) {
  return {cell(p.x() - offset_m, size_m), cell(p.y() - offset_m, size_m),
          cell(p.z() - offset_m, size_m)};
}

bool within_heights(double z_m, const VoxelMetricsConfig& config) {
  return z_m >= config.min_height_m && z_m <= config.max_height_m;
}

int ratio_of(const VoxelMetricsConfig& config) {
  const int ratio = static_cast<int>(std::lround(config.voxel_size_m / config.map_voxel_m));
  POCD_CHECK(ratio >= 1 && std::abs(ratio * config.map_voxel_m - config.voxel_size_m) < 1e-6);
  const double shift = config.offset_m / config.map_voxel_m;
  POCD_CHECK(std::abs(shift - std::round(shift)) < 1e-6);
  return ratio;
}

/// Voxels of which at least half was seen through in enough frames, floor and heights left out.
std::vector<VoxelIndex> free_voxels(const ObservedRegion& observed,
                                    const VoxelMetricsConfig& config) {
  const int ratio = ratio_of(config);
  std::map<VoxelIndex, int> count;
  for (const ObservedRegion::Block& block : observed.blocks()) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      if (block.voxels[static_cast<std::size_t>(i)].seen_through < config.min_frames) continue;
      const Eigen::Vector3d center =
          Eigen::Vector3d(8 * block.key.x + i % 8 + 0.5, 8 * block.key.y + i / 8 % 8 + 0.5,
                          8 * block.key.z + i / 64 + 0.5) *
          config.map_voxel_m;
      if (within_heights(center.z(), config))
        ++count[voxel_of(center, config.voxel_size_m, config.offset_m)];
    }
  }
  std::vector<VoxelIndex> voxels;
  for (const auto& [voxel, seen] : count) {
    if (2 * seen >= ratio * ratio * ratio) voxels.push_back(voxel);
  }
  return voxels;
}

/// Whether true surface lies within the tolerance of the voxel. The lattice is so fine that no
/// surface within it is farther than the tolerance from a lattice point.
bool near_truth(const VoxelIndex& voxel, const SurfaceTruth& truth,
                const VoxelMetricsConfig& config) {
  const int steps = static_cast<int>(std::ceil(config.voxel_size_m / config.tolerance_m));
  const double step_m = config.voxel_size_m / steps;
  for (int z = 0; z <= steps; ++z) {
    for (int y = 0; y <= steps; ++y) {
      for (int x = 0; x <= steps; ++x) {
        const Eigen::Vector3d p = Eigen::Vector3d(voxel.x, voxel.y, voxel.z) * config.voxel_size_m +
                                  Eigen::Vector3d(x, y, z) * step_m +
                                  Eigen::Vector3d::Constant(config.offset_m);
        if (truth.distance_m(p) <= config.tolerance_m) return true;
      }
    }
  }
  return false;
}

/// Voxels of the map that hold surface points, and all next to them.
std::set<VoxelIndex> fine_neighbourhood(const Points& points_W, const VoxelMetricsConfig& config) {
  std::set<VoxelIndex> fine;
  for (const Eigen::Vector3f& point : points_W) {
    fine.insert(voxel_of(point.cast<double>(), config.map_voxel_m, 0.0));
  }
  std::set<VoxelIndex> grown;
  for (const VoxelIndex& v : fine) {
    for (int n = 0; n < 27; ++n)
      grown.insert({v.x + n % 3 - 1, v.y + n / 3 % 3 - 1, v.z + n / 9 - 1});
  }
  return grown;
}

}  // namespace

double VoxelScore::precision() const {
  return percent(true_positives, true_positives + false_positives);
}
double VoxelScore::recall() const { return percent(recalled, recalled + false_negatives); }
double VoxelScore::false_positive_rate() const {
  return percent(false_positives, false_positives + true_negatives);
}

std::map<VoxelIndex, int> occupied_voxels(const Points& points_W,
                                          const VoxelMetricsConfig& config) {
  std::map<VoxelIndex, int> count;
  for (const Eigen::Vector3f& point : points_W) {
    if (within_heights(point.z(), config))
      ++count[voxel_of(point.cast<double>(), config.voxel_size_m, config.offset_m)];
  }
  for (auto it = count.begin(); it != count.end();) {
    it = it->second < config.min_points ? count.erase(it) : std::next(it);
  }
  return count;
}

VoxelScore score_against_reference(const Points& map_W, const Points& reference_W,
                                   const ObservedRegion& observed,
                                   const VoxelMetricsConfig& config) {
  const auto map = occupied_voxels(map_W, config);
  const auto reference = occupied_voxels(reference_W, config);
  VoxelScore score;
  for (const auto& [voxel, count] : map) {
    const bool right = reference.count(voxel) > 0;
    score.voxels[voxel] = right ? VoxelVerdict::kTruePositive : VoxelVerdict::kFalsePositive;
    ++(right ? score.true_positives : score.false_positives);
  }
  score.recalled = score.true_positives;
  for (const auto& [voxel, count] : reference) {
    if (map.count(voxel)) continue;
    score.voxels[voxel] = VoxelVerdict::kFalseNegative;
    ++score.false_negatives;
  }
  for (const VoxelIndex& voxel : free_voxels(observed, config)) {
    score.true_negatives += score.voxels.count(voxel) == 0;
  }
  return score;
}

VoxelScore score_against_truth(const Points& map_W, const SurfaceTruth& truth,
                               const ObservedRegion& observed, const VoxelMetricsConfig& config) {
  VoxelScore score;
  Points judged;
  for (const Eigen::Vector3f& point : map_W) {
    const VoxelIndex at = voxel_of(point.cast<double>(), config.map_voxel_m, 0.0);
    const ObservedRegion::Voxel voxel = observed.at(at.x, at.y, at.z);
    if (voxel.seen + voxel.seen_through >= config.min_frames) judged.push_back(point);
  }
  std::set<VoxelIndex> false_positives;
  for (const auto& [voxel, count] : occupied_voxels(judged, config)) {
    if (near_truth(voxel, truth, config)) {
      ++score.true_positives;
      score.voxels[voxel] = VoxelVerdict::kTruePositive;
    } else {
      ++score.false_positives;
      score.voxels[voxel] = VoxelVerdict::kFalsePositive;
      false_positives.insert(voxel);
    }
  }
  struct Wanted {
    int visible = 0, held = 0;
  };
  std::map<VoxelIndex, Wanted> wanted;
  const int ratio = ratio_of(config);
  const auto shift = static_cast<std::int32_t>(std::lround(config.offset_m / config.map_voxel_m));
  const auto down = [&](std::int32_t a) {
    const std::int32_t b = a - shift;
    return b >= 0 ? b / ratio : -((ratio - 1 - b) / ratio);
  };
  const std::set<VoxelIndex> held = fine_neighbourhood(map_W, config);
  for (const VoxelIndex& fine : truth.visible) {
    if (!within_heights((fine.z + 0.5) * config.map_voxel_m, config)) continue;
    Wanted& voxel = wanted[{down(fine.x), down(fine.y), down(fine.z)}];
    ++voxel.visible;
    voxel.held += held.count(fine) > 0;
  }
  std::int64_t recalled = 0, missed = 0;
  for (const auto& [voxel, count] : wanted) {
    if (count.visible < config.min_points) continue;
    if (2 * count.held >= count.visible) {
      ++recalled;
    } else {
      ++missed;
      score.voxels[voxel] = VoxelVerdict::kFalseNegative;
    }
  }
  score.recalled = recalled;
  score.false_negatives = missed;
  for (const VoxelIndex& voxel : free_voxels(observed, config)) {
    score.true_negatives += false_positives.count(voxel) == 0 && !near_truth(voxel, truth, config);
  }
  return score;
}

}  // namespace pocd
