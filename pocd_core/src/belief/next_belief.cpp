#include "pocd/belief/next_belief.hpp"

#include <algorithm>

namespace pocd {

UpdateResult next_belief(const Belief& before, const Measurement& measurement,
                         const StateConfig& state, const ChangeConfig& change) {
  UpdateResult result = bayesian_update(before, measurement, change.delta_max_m);
  Belief& after = result.belief;
  // The bound is on v alone: what is known of l goes on.
  if (after.stationarity() > state.max_stationarity && after.stationarity() > before.stationarity())
    after.alpha = before.alpha, after.beta = before.beta;
  after = clamp_counts(after, state.max_count);
  after.sigma = std::max(after.sigma, state.min_sigma_share * change.tau_m);
  return result;
}

void forget_evidence(Belief& belief, const StateConfig& state) {
  belief.alpha = state.initial_stationarity * state.initial_count;
  belief.beta = (1.0 - state.initial_stationarity) * state.initial_count;
}

}  // namespace pocd
