// How a measurement changes an object's belief.
#pragma once

#include "pocd/belief/next_belief.hpp"
#include "pocd/objects/object_library.hpp"
#include "pocd/observe/visibility.hpp"

namespace pocd {

/// Step 6 of the method: k by class and kind of measurement, then next_belief(). `sigma_m`:
/// standard deviation of the measured change. Changes object.belief and returns why, without a
/// rule.
Evidence apply_measurement(LibraryObject& object, double delta_m, double sigma_m,
                           const Sighting& sighting, const StateConfig& state,
                           const ChangeConfig& change);

}  // namespace pocd
