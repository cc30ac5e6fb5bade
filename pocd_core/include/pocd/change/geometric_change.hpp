// Step 5 of the method: by how much a matched object seems to have moved.
#pragma once

#include "pocd/association/associate.hpp"
#include "pocd/change/change_config.hpp"

namespace pocd {

/// Signed change Delta in [-delta_max, delta_max] [m]; positive when the surface came nearer.
///
/// measure "projective": for an object in place, the median over its visible points (measured and
/// seen through) of expected minus measured depth: one half of the points would have to move before
/// it does, while a mean follows every hole and border. For an object aligned elsewhere, its
/// displacement.
///
/// measure "ray_traced": the mean difference of two TSDFs (ray_traced_change); the displacement
/// where the two have no voxel in common.
double geometric_change(const LibraryObject& object, const Observation& observation,
                        const Sighting& sighting, const Match& match, const OrganizedCloud& cloud,
                        const ChangeConfig& config);

}  // namespace pocd
