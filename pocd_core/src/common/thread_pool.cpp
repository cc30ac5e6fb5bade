#include "pocd/common/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "pocd/common/check.hpp"

namespace pocd {

struct ThreadPool::Impl {
  using Piece = std::function<void(std::size_t, std::size_t)>;

  std::vector<std::thread> workers;
  std::mutex mutex;
  std::condition_variable wake, done;
  const Piece* piece = nullptr;
  std::size_t count = 0, grain = 1;
  std::atomic<std::size_t> next{0};
  std::uint64_t job = 0;
  std::size_t running = 0;
  bool stop = false;
  std::exception_ptr error;

  void drain() {
    for (;;) {
      const std::size_t begin = next.fetch_add(grain);
      if (begin >= count) return;
      try {
        (*piece)(begin, std::min(count, begin + grain));
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!error) error = std::current_exception();
      }
    }
  }

  void work() {
    std::uint64_t seen = 0;
    std::unique_lock<std::mutex> lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return stop || job != seen; });
      if (stop) return;
      seen = job;
      lock.unlock();
      drain();
      lock.lock();
      if (--running == 0) done.notify_one();
    }
  }
};

ThreadPool::ThreadPool(int threads) : impl_(std::make_unique<Impl>()) {
  POCD_CHECK(threads >= 1);
  for (int i = 1; i < threads; ++i) impl_->workers.emplace_back([this] { impl_->work(); });
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

void ThreadPool::parallel_for(std::size_t count, std::size_t grain, const Impl::Piece& piece) {
  POCD_CHECK(grain > 0);
  if (impl_->workers.empty() || count <= grain) {
    for (std::size_t begin = 0; begin < count; begin += grain) {
      piece(begin, std::min(count, begin + grain));
    }
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(impl_->mutex);
    impl_->piece = &piece;
    impl_->count = count;
    impl_->grain = grain;
    impl_->next = 0;
    impl_->error = nullptr;
    impl_->running = impl_->workers.size();
    ++impl_->job;
  }
  impl_->wake.notify_all();
  impl_->drain();
  std::unique_lock<std::mutex> lock(impl_->mutex);
  impl_->done.wait(lock, [&] { return impl_->running == 0; });
  if (impl_->error) std::rethrow_exception(impl_->error);
}

}  // namespace pocd
