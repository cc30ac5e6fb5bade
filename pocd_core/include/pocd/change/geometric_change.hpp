// Step 5 of the method: by how much a matched object seems to have moved.
#pragma once

#include "pocd/association/associate.hpp"
#include "pocd/change/change_config.hpp"

namespace pocd {

/// Signed change Delta in [-delta_max, delta_max] [m]; positive when the surface came nearer.
///
/// measure "projective": for an object in place, the median of expected minus measured depth over
/// its visible points within tau, or over all where none is: one half of the points would have to
/// move before it does, while a mean follows every hole and border. For an object aligned
/// elsewhere, its displacement.
///
/// measure "ray_traced": the mean difference of two TSDFs (ray_traced_change), for an object in
/// place with the sign of the mean signed difference; the displacement where the two have no voxel
/// in common.
double geometric_change(const LibraryObject& object, const Observation& observation,
                        const Sighting& sighting, const Match& match, const OrganizedCloud& cloud,
                        const ChangeConfig& config);

}  // namespace pocd
