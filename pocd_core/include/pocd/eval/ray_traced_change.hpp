// The published measure of geometric change between an object and its observation: the mean
// difference of two TSDFs made by ray tracing both point clouds through the optical centre (Qian et
// al., RSS 2022, Section IV-A, equation 2).
#pragma once

#include <cstddef>
#include <optional>

#include "pocd/common/types.hpp"

namespace pocd {

struct RayTracedChangeOptions {
  double voxel_size_m = 0.05;  ///< > 0
  /// Half the thickness of the band around each surface, >= voxel_size_m. Surfaces farther apart
  /// than twice this along the ray share no voxel.
  double truncation_m = 0.8;
  double lambda_diff = 1.6;  ///< scale of the published measure, >= 0
};

struct RayTracedChange {
  /// Delta = lambda_diff * sign * mean over Omega of |tsdf(object) - tsdf(observation)| [m].
  double delta_m = 0.0;
  /// |Omega|: voxels that the bands of both clouds hold.
  std::size_t voxels = 0;
  /// Mean over Omega of tsdf(object) - tsdf(observation) [m]: positive where the observation lies
  /// in front. Not scaled.
  double mean_signed_m = 0.0;
};

/// Both clouds in the optical frame of the camera (z forward). `icp_translation_z_C_m` is the z
/// component, in that frame, of the translation that takes the object to the observation; Delta is
/// positive if it is negative (the observation lies in front of the object, seen from the camera),
/// and negative otherwise.
///
/// The voxel grid has a corner at the optical centre. A point at range r sets the voxels that its
/// ray crosses at distances c of r - truncation to r + truncation to the signed distance r - c,
/// positive in front of the surface; c is that of the voxel's centre projected on the ray. A voxel
/// crossed by several rays has their mean. "Non-zero in both" of the paper is read as "set in
/// both".
///
/// nullopt if no voxel is set in both: nothing was measured, not "no change". Points at the optical
/// centre are ignored; points must be finite (std::logic_error). The same input gives the same
/// bits.
std::optional<RayTracedChange> ray_traced_change(const Points& object_C,
                                                 const Points& observation_C,
                                                 double icp_translation_z_C_m,
                                                 const RayTracedChangeOptions& options);

}  // namespace pocd
