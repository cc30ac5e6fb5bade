// Beliefs as objects may have them.
#pragma once

#include <cmath>

#include "pocd/belief/belief.hpp"
#include "pocd/belief/state_config.hpp"
#include "pocd/common/random.hpp"

namespace pocd {

inline Belief random_belief(Random& random, const StateConfig& state) {
  const double count = std::exp(random.uniform(std::log(0.2), std::log(state.max_count)));
  const double mean = random.uniform(0.02, 0.98);
  return {random.uniform(-0.3, 0.3), std::exp(random.uniform(std::log(0.1), std::log(1.0))),
          mean * count, (1 - mean) * count};
}

}  // namespace pocd
