// How the library calls back, and what becomes of what a program is too slow for. No DDS type shows
// here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace pocd {

/// What is done with a call when as many wait as may.
enum class WhenFull {
  kWait,        ///< nothing is dropped here; the bus holds it back, see where it is used
  kDropOldest,  ///< of those that wait
  kDropNewest,  ///< this one
};

struct CallbackOptions {
  std::size_t most_waiting = 10000;  ///< calls; at least 1
  WhenFull when_full = WhenFull::kWait;
};

struct CallbackStatus {
  std::uint64_t called = 0;
  std::uint64_t failed = 0;   ///< have thrown; the next ones are called all the same
  std::uint64_t dropped = 0;  ///< never called
  std::size_t waiting = 0;
  std::string last_failure;  ///< text of the last exception
};

}  // namespace pocd
