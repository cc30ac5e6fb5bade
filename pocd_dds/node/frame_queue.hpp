// Frames between the thread that takes them from the bus and the one that runs the pipeline.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
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

  /// When full, the oldest frame of the robot that has most of them (this one included) is dropped
  /// and counted: who sends much does not push out who sends little.
  void push_dropping(Frame frame) {
    const std::string robot = frame.robot;
    const auto choose = [&robot](const auto& frames) { return unfair(frames, robot); };
    frames_.push_making_room(std::move(frame), 1, choose, [this](const Frame& gone) {
      const std::lock_guard<std::mutex> lock(mutex_);
      dropped_frames_.push_back(
          {gone.robot, gone.stamp_ns, !gone.labels.empty(), !gone.color.empty()});
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
  /// Index of the oldest frame of the robot with most frames; of equal ones, the oldest frame.
  template <class Frames>
  static std::size_t unfair(const Frames& frames, const std::string& coming) {
    std::map<std::string, std::size_t> count{{coming, 1}};
    for (const auto& entry : frames) ++count[entry.first.robot];
    std::size_t most = 0, index = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const std::size_t of_robot = count.at(frames[i].first.robot);
      if (of_robot <= most) continue;
      most = of_robot;
      index = i;
    }
    return index;
  }

  ClosableQueue<Frame> frames_;
  mutable std::mutex mutex_;  // of what follows
  std::uint64_t dropped_ = 0;
  std::vector<DroppedFrame> dropped_frames_;
};

}  // namespace pocd::dds
