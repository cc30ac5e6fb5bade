// Step 5 of the method: how far the surface of an object in its place lies from where it was.
#pragma once

#include "pocd/belief/change_config.hpp"
#include "pocd/observe/visibility.hpp"

namespace pocd {

/// Minus the median of measured - expected depth [m] over the points that were measured within
/// tau_m of their place: positive when the surface is nearer to the camera than it was. 0 when
/// there is none.
/// Each point is compared with the nearest depth among the 3 x 3 pixels around it, which takes the
/// sideways error of the pose out and pulls small changes towards 0.
double geometric_change(const Sighting& sighting, const ChangeConfig& config);

}  // namespace pocd
