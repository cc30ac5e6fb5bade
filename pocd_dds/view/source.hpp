// Where what is shown comes from, as the server asks it.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "pocd/common/types.hpp"

namespace pocd::view {

/// Thread-safe.
class Source {
 public:
  virtual ~Source() = default;
  /// What is known of an object's past, or nothing: JSON, {"type": "history", ...}.
  virtual std::optional<std::string> history(const std::string& uuid) const = 0;
  /// Objects and robots as they were at a stamp [s]: JSON, {"type": "then", ...}.
  virtual std::string then(double stamp_s) const = 0;
};

/// Outside of what a stamp [s] can be it is the first or the last one.
inline StampNs stamp_from(double stamp_s) {
  return static_cast<StampNs>(std::llround(std::clamp(stamp_s, -9e9, 9e9) * 1e9));
}

}  // namespace pocd::view
