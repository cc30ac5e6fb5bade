// A network of its own for a measurement, and what processes and that network have used.
#pragma once

#include <cstdint>
#include <string>

#include <sys/types.h>

namespace pocd::benchmark {

/// Makes this process and all that it starts a host of its own with nothing but loopback, limited
/// to `link_mbit` megabits per second (0: not). Returns what was not possible, empty: nothing; then
/// the bytes below are those of the whole machine.
std::string enter_own_network(double link_mbit);

/// Bytes that went over the loopback interface, with all headers.
std::uint64_t loopback_bytes();

struct ProcessCost {
  double cpu_s = 0.0;
  double memory_mb = 0.0;  ///< resident
};
/// Of a running process; of this one with pid 0.
ProcessCost process_cost(pid_t pid);

}  // namespace pocd::benchmark
