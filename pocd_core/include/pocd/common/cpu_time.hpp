// Clocks of the system, for what is measured and never for what is decided.
#pragma once

#include <ctime>

namespace pocd {

/// Thread-safe.
inline double clock_ms(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// CPU time of the calling thread so far [ms].
inline double thread_cpu_ms() { return clock_ms(CLOCK_THREAD_CPUTIME_ID); }
/// CPU time of the whole process so far [ms].
inline double process_cpu_ms() { return clock_ms(CLOCK_PROCESS_CPUTIME_ID); }

}  // namespace pocd
