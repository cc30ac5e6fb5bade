// Frames between the thread that takes them from the bus and the one that runs the pipeline.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd_dds/entities/closable_queue.hpp"

namespace pocd::dds {

struct DroppedFrame {
  std::string robot;
  StampNs stamp_ns = 0;
  bool with_segmentation = false, with_color = false;
};

/// Bounded by the number of frames. Thread-safe.
class FrameQueue {
 public:
  explicit FrameQueue(std::size_t capacity) : frames_(capacity) {}

  /// When full, the oldest frame is dropped and counted.
  void push_dropping(Frame frame) {
    frames_.push_making_room(std::move(frame), 1, [this](const Frame& oldest) {
      const std::lock_guard<std::mutex> lock(mutex_);
      dropped_frames_.push_back(
          {oldest.robot, oldest.stamp_ns, !oldest.labels.empty(), !oldest.color.empty()});
      ++dropped_;
    });
  }
  /// Those dropped since the last call.
  std::vector<DroppedFrame> take_dropped() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(dropped_frames_, {});
  }
  /// Beyond the capacity, too: for the one who asked has_room(), and for the last frames of a run.
  void push(Frame frame) { frames_.push(std::move(frame), 1); }
  bool has_room() const { return frames_.has_room(); }

  /// Waits for a frame. Nothing after `time`, or once the queue is closed and empty.
  std::optional<Frame> pop(std::chrono::milliseconds time) { return frames_.pop(time); }
  void close() { frames_.close(); }
  bool finished() const { return frames_.finished(); }
  std::size_t size() const { return frames_.size(); }
  std::uint64_t dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

 private:
  ClosableQueue<Frame> frames_;
  mutable std::mutex mutex_;  // of what follows
  std::uint64_t dropped_ = 0;
  std::vector<DroppedFrame> dropped_frames_;
};

}  // namespace pocd::dds
