// The surface of one object as oriented points (surfels), about one per voxel, fused over frames.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "pocd/segmentation/observations.hpp"

namespace pocd {

struct Surfel {
  Eigen::Vector3f point_W;
  Eigen::Vector3f normal_W;       ///< unit, or zero where unknown
  float weight = 0.0f;            ///< sum of inverse variances [1/m2], capped
  std::uint16_t hits = 0;         ///< frames that measured it
  std::uint8_t seen_through = 0;  ///< looks in a row that saw through it
  bool arrived = false;           ///< its place was seen empty before it was first measured
  StampNs last_hit_ns = 0;        ///< of the last frame that measured it
};

/// Not thread-safe. Order of surfels is the order of their creation.
class ObjectModel {
 public:
  explicit ObjectModel(double spacing_m);

  const std::vector<Surfel>& surfels() const { return surfels_; }
  std::vector<Surfel>& surfels() { return surfels_; }
  double spacing_m() const { return spacing_m_; }

  /// Index of the nearest surfel within `radius_m` (at most the spacing), or kNone.
  int nearest(const Eigen::Vector3f& point_W, float radius_m) const;
  static constexpr int kNone = -1;

  /// Share of the points with a surfel within `radius_m`; looks at no more than `budget` of them.
  double explained_share(const std::vector<SurfacePoint>& points, float radius_m, int budget) const;

  /// Fuses the measured points of one frame: a surfel near one moves along its normal by inverse
  /// variance; else a new one is made. Returns how many are new.
  int fuse(const std::vector<SurfacePoint>& points, StampNs stamp_ns);

  /// Adds the surfels of another model where this one has none.
  void absorb(const ObjectModel& other);

  /// Takes out the surfels that are marked (one entry per surfel, non-zero: out) and returns them.
  std::vector<Surfel> extract(const std::vector<std::uint8_t>& marked);

  /// Adds surfels as they are, where this model has none.
  void add(const std::vector<Surfel>& surfels);

  /// Applies a rigid motion to all surfels.
  void transform(const Pose& T_new_old);

 private:
  friend struct ArchiveAccess;
  std::uint64_t cell_of(const Eigen::Vector3f& p) const;
  void rebuild_index();
  /// Lists a surfel that crept out of its cell in the one where it is now.
  void refile(std::int32_t i, std::uint64_t old_cell);

  double spacing_m_;
  float inverse_spacing_;
  std::vector<Surfel> surfels_;
  std::unordered_map<std::uint64_t, std::int32_t> index_;  ///< look-up only, never iterated
};

}  // namespace pocd
