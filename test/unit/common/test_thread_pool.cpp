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

// More threads than pieces, and than processors: some wake up when the job is long over.
TEST(ThreadPool, ManyShortJobsLoseAndRepeatNothing) {
  ThreadPool pool(8);
  for (int job = 0; job < 5000; ++job) {
    std::vector<int> done(3, 0);  // of this job only: a late thread would write to freed memory
    pool.parallel_for(done.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) done[i] += job;
    });
    for (const int value : done) ASSERT_EQ(value, job);
  }
}

TEST(ThreadPool, CountsTheTimeOfItsOwnThreads) {
  ThreadPool alone(1), two(2);
  const auto spin = [](std::size_t, std::size_t) {
    volatile double x = 1.0;
    for (int i = 0; i < 10000; ++i) x = x * 1.0000001;
  };
  alone.parallel_for(100, 1, spin);
  EXPECT_EQ(alone.worker_cpu_ms(), 0.0);
  // Until the other thread has got a piece, however busy the machine is.
  while (two.worker_cpu_ms() == 0.0) two.parallel_for(100, 1, spin);
  const double before_ms = two.worker_cpu_ms();
  two.parallel_for(100, 1, spin);
  EXPECT_GE(two.worker_cpu_ms(), before_ms);
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
