// How a measurement changes an object's belief.
#pragma once

#include "pocd/association/visibility.hpp"
#include "pocd/change/change_config.hpp"
#include "pocd/map/object_library.hpp"
#include "pocd/state/bayesian_update.hpp"
#include "pocd/state/state_config.hpp"

namespace pocd {

/// Steps 6 of the method: k by class and kind of measurement, the Bayesian update, the bound v_max,
/// the cap of alpha + beta, the floor of sigma. `sigma_m`: standard deviation of the measured
/// change. Changes object.belief and returns why, without a rule.
Evidence apply_measurement(LibraryObject& object, double delta_m, double sigma_m,
                           const Sighting& sighting, const StateConfig& state,
                           const ChangeConfig& change);

/// The belief after one measurement, as apply_measurement makes it: every published transition can
/// be recomputed with it from the evidence alone.
Belief next_belief(const Belief& before, const Measurement& measurement, const StateConfig& state,
                   const ChangeConfig& change);

/// Sets alpha and beta to those of a new object; mu and sigma stay.
void forget_evidence(Belief& belief, const StateConfig& state);

}  // namespace pocd
