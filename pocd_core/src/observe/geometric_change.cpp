#include "pocd/observe/geometric_change.hpp"

#include <algorithm>
#include <cmath>

namespace pocd {

double geometric_change(const Sighting& sighting, const ChangeConfig& config) {
  // Points that are seen through altogether tell whether the object is there, not how far it moved.
  std::vector<float> values;
  for (const float d : sighting.differences_m) {
    if (std::abs(d) <= config.tau_m) values.push_back(d);
  }
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return std::clamp(-static_cast<double>(*middle), -config.delta_max_m, config.delta_max_m);
}

}  // namespace pocd
