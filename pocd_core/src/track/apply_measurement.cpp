#include "pocd/track/apply_measurement.hpp"

#include <algorithm>

namespace pocd {

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
  const UpdateResult update = next_belief(object.belief, measurement, state, change);
  evidence.c1 = update.c1;
  evidence.c2 = update.c2;
  evidence.after = object.belief = update.belief;
  return evidence;
}

}  // namespace pocd
