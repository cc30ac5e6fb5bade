// What was freed between what is in use goes back to the system.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "apps/heap_return.hpp"

namespace pocd::dds {
namespace {

/// Anonymous memory of this process that is in RAM [kB].
long resident_kb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("RssAnon:", 0) == 0) return std::stol(line.substr(8));
  }
  return -1;
}

TEST(HeapReturn, GivesBackWhatIsFreeBetweenWhatIsInUseOnceAMinute) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "a sanitizer has a heap of its own";
#endif
  constexpr std::size_t kPiece = 16 << 10, kPieces = 4000;  // 64 MB in the heap, not in mappings
  std::vector<std::unique_ptr<char[]>> pieces;
  for (std::size_t i = 0; i < kPieces; ++i) {
    pieces.emplace_back(new char[kPiece]);
    std::memset(pieces.back().get(), static_cast<int>(i), kPiece);
  }
  for (std::size_t i = 0; i < kPieces; ++i) {
    if (i % 8 != 0) pieces[i].reset();
  }
  const long fragmented_kb = resident_kb();
  const HeapReturn::Clock::time_point start{};
  HeapReturn heap(start);
  EXPECT_FALSE(heap.turn(start + std::chrono::seconds(59)));
  EXPECT_GT(resident_kb(), fragmented_kb - 10000);
  EXPECT_TRUE(heap.turn(start + std::chrono::seconds(60)));
  EXPECT_LT(resident_kb(), fragmented_kb - 30000);
  EXPECT_FALSE(heap.turn(start + std::chrono::seconds(61)));
}

}  // namespace
}  // namespace pocd::dds
