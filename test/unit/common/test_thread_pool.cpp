#include "pocd/common/thread_pool.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace pocd {
namespace {

TEST(ThreadPool, EveryIndexIsDoneOnceForAnyThreadCount) {
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (int repeat = 0; repeat < 50; ++repeat) {
      std::vector<int> done(1013, 0);
      pool.parallel_for(done.size(), 7, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++done[i];
      });
      for (const int count : done) ASSERT_EQ(count, 1);
    }
  }
}

TEST(ThreadPool, ExceptionOfAPieceReachesTheCallerAndThePoolGoesOn) {
  ThreadPool pool(3);
  const auto broken = [&] {
    pool.parallel_for(100, 1, [](std::size_t begin, std::size_t) {
      if (begin == 42) throw std::runtime_error("piece 42");
    });
  };
  EXPECT_THROW(broken(), std::runtime_error);
  std::vector<int> done(10, 0);
  pool.parallel_for(10, 1, [&](std::size_t begin, std::size_t) { done[begin] = 1; });
  for (const int flag : done) EXPECT_EQ(flag, 1);
}

TEST(ThreadPool, NoThreadsIsABrokenInvariant) { EXPECT_THROW(ThreadPool(0), std::logic_error); }

}  // namespace
}  // namespace pocd
