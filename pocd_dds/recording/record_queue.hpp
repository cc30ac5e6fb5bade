// Samples between the threads that receive and the one that writes.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "pocd/recording/mcap_records.hpp"

namespace pocd::dds {

struct QueuedSample {
  recording::MessageHeader header;
  recording::Bytes payload;
};

/// Bounded in bytes. Buffers that were written come back: large ones are costly to get from the
/// system again and again. Thread-safe.
class RecordQueue {
 public:
  explicit RecordQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// False, and counted, when there is no room.
  bool push(QueuedSample sample) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (bytes_ + sample.payload.size() > most_bytes_) {
        ++dropped_;
        return false;
      }
      bytes_ += sample.payload.size();
      samples_.push_back(std::move(sample));
    }
    filled_.notify_one();
    return true;
  }
  /// Nothing after `time`, or at once when the queue is closed and empty.
  std::optional<QueuedSample> pop(std::chrono::milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex_);
    filled_.wait_for(lock, time, [this] { return closed_ || !samples_.empty(); });
    if (samples_.empty()) return std::nullopt;
    QueuedSample sample = std::move(samples_.front());
    samples_.pop_front();
    bytes_ -= sample.payload.size();
    return sample;
  }
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    filled_.notify_all();
  }
  bool finished() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return closed_ && samples_.empty();
  }

  recording::Bytes buffer() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (spare_.empty()) return {};
    recording::Bytes bytes = std::move(spare_.back());
    spare_.pop_back();
    return bytes;
  }
  void give_back(recording::Bytes bytes) {
    constexpr std::size_t kMostSpare = 32;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (spare_.size() < kMostSpare) spare_.push_back(std::move(bytes));
  }

  std::size_t bytes() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return bytes_;
  }
  std::uint64_t dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

 private:
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<QueuedSample> samples_;
  std::vector<recording::Bytes> spare_;
  std::size_t bytes_ = 0;
  bool closed_ = false;
  std::uint64_t dropped_ = 0;
};

}  // namespace pocd::dds
