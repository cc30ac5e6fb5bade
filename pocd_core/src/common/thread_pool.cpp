#include "pocd/common/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"

namespace pocd {
namespace {

/// How long a thread looks before it lies down to sleep: about as long as being woken up takes.
constexpr std::chrono::microseconds kLook{100};

void relax() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Waits a little for `condition`; it may still be false afterwards.
template <class Condition>
void look_for(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + kLook;
  while (!condition() && std::chrono::steady_clock::now() < end) {
    for (int i = 0; i < 16; ++i) relax();
  }
}

}  // namespace

struct ThreadPool::Impl {
  using Piece = std::function<void(std::size_t, std::size_t)>;

  /// The pieces that one thread begins with: neighbours stay together, and in one cache.
  struct alignas(64) Share {
    std::atomic<std::size_t> next{0};
    std::size_t end = 0;
  };

  std::vector<std::thread> workers;
  std::vector<Share> shares;  ///< the caller's, then the workers'
  bool look = true;           ///< there is a processor for each thread
  // Changed under the mutex only; atomic where somebody looks without it.
  std::mutex mutex;
  std::condition_variable wake, done;
  const Piece* piece = nullptr;
  std::size_t grain = 1;
  bool open = false;  ///< workers may still join the job
  std::atomic<std::uint64_t> job{0}, roused{0};
  std::atomic<std::size_t> inside{0};  ///< workers that have joined and not left
  std::atomic<bool> stop{false};
  double worker_cpu_ms = 0.0;
  std::exception_ptr error;

  /// Takes pieces of its own share, then of those of the others.
  void drain(std::size_t self) {
    for (std::size_t i = 0; i < shares.size(); ++i) {
      Share& share = shares[(self + i) % shares.size()];
      for (;;) {
        const std::size_t begin = share.next.fetch_add(grain);
        if (begin >= share.end) break;
        try {
          (*piece)(begin, std::min(share.end, begin + grain));
        } catch (...) {
          const std::lock_guard<std::mutex> lock(mutex);
          if (!error) error = std::current_exception();
        }
      }
    }
  }

  void work(std::size_t self) {
    std::uint64_t seen = 0, seen_roused = 0;
    const auto called = [&] { return stop || job != seen; };
    for (;;) {
      if (look) look_for(called);
      std::unique_lock<std::mutex> lock(mutex);
      wake.wait(lock, [&] { return called() || roused != seen_roused; });
      if (stop) return;
      seen_roused = roused;
      if (job == seen) continue;
      seen = job;
      if (!open) continue;  // the others were done before this one woke up
      ++inside;
      lock.unlock();
      const double before_ms = thread_cpu_ms();
      drain(self);
      const double spent_ms = thread_cpu_ms() - before_ms;
      lock.lock();
      worker_cpu_ms += spent_ms;
      if (--inside == 0) done.notify_one();
    }
  }

  void begin(std::size_t n, std::size_t size, const Piece& what) {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      piece = &what;
      grain = size;
      const std::size_t pieces = (n + size - 1) / size;
      for (std::size_t i = 0; i < shares.size(); ++i) {
        shares[i].next = pieces * i / shares.size() * size;
        shares[i].end = std::min(n, pieces * (i + 1) / shares.size() * size);
      }
      error = nullptr;
      open = true;
      ++job;
    }
    wake.notify_all();
  }

  /// Waits for those who have joined, not for those who sleep.
  void end() {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      open = false;
    }
    const auto left = [&] { return inside == 0; };
    if (look) look_for(left);
    std::unique_lock<std::mutex> lock(mutex);
    done.wait(lock, left);
    if (error) std::rethrow_exception(error);
  }
};

ThreadPool::ThreadPool(int threads) : impl_(std::make_unique<Impl>()) {
  POCD_CHECK(threads >= 1);
  impl_->look = static_cast<int>(std::thread::hardware_concurrency()) >= threads;
  const auto count = static_cast<std::size_t>(threads);
  impl_->shares = std::vector<Impl::Share>(count);
  for (std::size_t i = 1; i < count; ++i) {
    impl_->workers.emplace_back([this, i] { impl_->work(i); });
  }
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard<std::mutex> lock(impl_->mutex);
    impl_->stop = true;
  }
  impl_->wake.notify_all();
  for (auto& worker : impl_->workers) worker.join();
}

int ThreadPool::threads() const { return static_cast<int>(impl_->workers.size()) + 1; }

void ThreadPool::rouse() {
  if (impl_->workers.empty() || !impl_->look) return;
  {
    const std::lock_guard<std::mutex> lock(impl_->mutex);
    ++impl_->roused;
  }
  impl_->wake.notify_all();
}

double ThreadPool::worker_cpu_ms() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->worker_cpu_ms;
}

void ThreadPool::parallel_for(std::size_t count, std::size_t grain, const Impl::Piece& piece) {
  POCD_CHECK(grain > 0);
  if (impl_->workers.empty() || count <= grain) {
    for (std::size_t begin = 0; begin < count; begin += grain) {
      piece(begin, std::min(count, begin + grain));
    }
    return;
  }
  impl_->begin(count, grain, piece);
  impl_->drain(0);
  impl_->end();
}

}  // namespace pocd
