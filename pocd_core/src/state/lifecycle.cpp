#include "pocd/state/lifecycle.hpp"

#include <algorithm>
#include <cmath>

namespace pocd {
Belief next_belief(const Belief& before, const Measurement& measurement, const StateConfig& state,
                   const ChangeConfig& change) {
  Belief after = bayesian_update(before, measurement, change.delta_max_m).belief;
  // The bound is on v alone: what is known of l goes on.
  if (after.stationarity() > state.max_stationarity && after.stationarity() > before.stationarity())
    after.alpha = before.alpha, after.beta = before.beta;
  after = clamp_counts(after, state.max_count);
  after.sigma = std::max(after.sigma, state.min_sigma_share * change.tau_m);
  return after;
}

Evidence apply_measurement(LibraryObject& object, double delta_m, double sigma_m,
                           const Sighting& sighting, const StateConfig& state,
                           const ChangeConfig& change) {
  Evidence evidence;
  evidence.delta_m = std::clamp(delta_m, -change.delta_max_m, change.delta_max_m);
  evidence.stationarity_class = object.stationarity_class;
  evidence.measurement_sigma_m = sigma_m;
  evidence.visible_share = sighting.visible_share();
  evidence.seen_through_share = sighting.seen_through_share();
  evidence.before = object.belief;
  Measurement measurement{evidence.delta_m, object.stationarity_class, sigma_m, 0.0};
  measurement.k = adaptive_k(object.belief, measurement, change.delta_max_m, state.k);
  evidence.k = measurement.k;
  const UpdateResult update = bayesian_update(object.belief, measurement, change.delta_max_m);
  evidence.c1 = update.c1;
  evidence.c2 = update.c2;
  object.belief = next_belief(object.belief, measurement, state, change);
  evidence.after = object.belief;
  return evidence;
}

void forget_evidence(Belief& belief, const StateConfig& state) {
  belief.alpha = state.initial_stationarity * state.initial_count;
  belief.beta = (1.0 - state.initial_stationarity) * state.initial_count;
}

}  // namespace pocd
