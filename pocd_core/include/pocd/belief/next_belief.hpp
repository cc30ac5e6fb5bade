// A step of a belief: the published update and its bounds.
#pragma once

#include "pocd/belief/bayesian_update.hpp"
#include "pocd/belief/change_config.hpp"
#include "pocd/belief/state_config.hpp"

namespace pocd {

/// The belief after one measurement: the Bayesian update, the bound v_max, the cap of alpha + beta,
/// the floor of sigma; c1 and c2 are those of the update. Every published transition can be
/// recomputed with it from the evidence alone.
UpdateResult next_belief(const Belief& before, const Measurement& measurement,
                         const StateConfig& state, const ChangeConfig& change);

/// Sets alpha and beta to those of a new object; mu and sigma stay.
void forget_evidence(Belief& belief, const StateConfig& state);

}  // namespace pocd
