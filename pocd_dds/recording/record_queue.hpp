// Samples between the threads that receive and the one that writes.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "pocd/recording/mcap_records.hpp"
#include "pocd_dds/entities/closable_queue.hpp"

namespace pocd::dds {

/// A writer, or an instance of a keyed topic.
using LatchKey = std::array<std::uint8_t, 16>;

/// What a sample of a latched topic is to those who join later.
struct Latch {
  enum class Part { kSample, kInstance, kGone, kWriterGone };
  std::uint16_t channel = 0;  ///< of the topic's samples, for all parts
  LatchKey source{};
  bool keyed = false;
  Part part = Part::kSample;
};

struct QueuedSample {
  recording::MessageHeader header;
  recording::Bytes payload;
  std::optional<Latch> latch;

  /// False: it only says that a writer has gone.
  bool is_message() const { return !latch || latch->part != Latch::Part::kWriterGone; }
};

/// Bounded in bytes. Buffers that were written come back, as far as they are few and not too large
/// together: large ones are costly to get from the system again and again. Thread-safe.
class RecordQueue {
 public:
  explicit RecordQueue(std::size_t most_bytes) : samples_(most_bytes) {}

  /// False, and counted, when there is no room.
  bool push(QueuedSample sample) {
    const std::size_t bytes = sample.payload.size();
    const bool room = samples_.push_if_room(std::move(sample), bytes);
    if (!room) ++dropped_;
    return room;
  }
  /// Nothing after `time`, or at once when the queue is closed and empty.
  std::optional<QueuedSample> pop(std::chrono::milliseconds time) { return samples_.pop(time); }
  void close() { samples_.close(); }
  bool finished() const { return samples_.finished(); }

  recording::Bytes buffer() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (spare_.empty()) return {};
    recording::Bytes bytes = std::move(spare_.back());
    spare_.pop_back();
    spare_bytes_ -= bytes.capacity();
    return bytes;
  }
  void give_back(recording::Bytes bytes) {
    constexpr std::size_t kMostSpare = 32, kMostSpareBytes = 16u << 20;
    const std::lock_guard<std::mutex> lock(mutex_);
    // Each of them comes to the size of the largest samples that there are, in time.
    if (spare_.size() >= kMostSpare || spare_bytes_ + bytes.capacity() > kMostSpareBytes) return;
    spare_bytes_ += bytes.capacity();
    spare_.push_back(std::move(bytes));
  }

  std::size_t bytes() const { return samples_.weight(); }
  std::uint64_t dropped() const { return dropped_; }

 private:
  ClosableQueue<QueuedSample> samples_;
  std::mutex mutex_;  // of these two
  std::vector<recording::Bytes> spare_;
  std::size_t spare_bytes_ = 0;
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace pocd::dds
