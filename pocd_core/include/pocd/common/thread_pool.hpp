// A small fixed pool for data-parallel loops whose result must not depend on the thread count.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace pocd {

/// Runs independent pieces of a loop. With threads == 1 nothing is started and the caller's thread
/// does all. parallel_for may not be called from two threads at once, nor from inside a piece.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const;
  /// CPU time that the threads other than the caller's have spent on pieces so far [ms].
  double worker_cpu_ms() const;

  /// Work follows at once: who sleeps may wake up meanwhile.
  void rouse();

  /// Calls piece(begin, end) over [0, count) cut in chunks of `grain`, in any order and on any
  /// thread; returns when all are done. A piece must write only what its own indices own, so that
  /// the result is the same for every thread count. The first exception of a piece is rethrown.
  void parallel_for(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t begin, std::size_t end)>& piece);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd
