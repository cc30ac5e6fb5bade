// What a piece of code takes from the heap.
#pragma once

#include <cstdint>

namespace pocd::benchmark {

/// Calls of operator new and bytes asked for, since the start, by the calling thread.
struct HeapCount {
  std::uint64_t calls = 0, bytes = 0;
};
HeapCount heap_count();

/// Bytes in use on the heap of the process, by whatever allocated them.
std::uint64_t heap_in_use();

}  // namespace pocd::benchmark
