// Frames between the thread that takes them from the bus and the one that runs the pipeline.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pocd/input/frame.hpp"

namespace pocd::dds {

struct DroppedFrame {
  std::string robot;
  StampNs stamp_ns = 0;
  bool with_segmentation = false, with_color = false;
};

/// Bounded. Thread-safe.
class FrameQueue {
 public:
  explicit FrameQueue(std::size_t capacity) : capacity_(capacity) {}

  /// When full, the oldest frame is dropped and counted.
  void push_dropping(Frame frame) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (frames_.size() >= capacity_) {
        Frame& oldest = frames_.front();
        dropped_frames_.push_back(
            {oldest.robot, oldest.stamp_ns, !oldest.labels.empty(), !oldest.color.empty()});
        frames_.pop_front();
        ++dropped_;
      }
      frames_.push_back(std::move(frame));
    }
    filled_.notify_one();
  }
  /// Those dropped since the last call.
  std::vector<DroppedFrame> take_dropped() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(dropped_frames_, {});
  }
  /// Beyond the capacity, too: for the one who asked has_room(), and for the last frames of a run.
  void push(Frame frame) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      frames_.push_back(std::move(frame));
    }
    filled_.notify_one();
  }
  bool has_room() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return frames_.size() < capacity_;
  }

  /// Waits for a frame. Nothing after `time`, or once the queue is closed and empty (see
  /// finished()).
  std::optional<Frame> pop(std::chrono::milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex_);
    filled_.wait_for(lock, time, [this] { return closed_ || !frames_.empty(); });
    if (frames_.empty()) return std::nullopt;
    Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
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
    return closed_ && frames_.empty();
  }
  std::size_t size() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return frames_.size();
  }
  std::uint64_t dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Frame> frames_;
  bool closed_ = false;
  std::uint64_t dropped_ = 0;
  std::vector<DroppedFrame> dropped_frames_;
};

}  // namespace pocd::dds
