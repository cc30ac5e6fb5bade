// Publishes what became of every frame: a recording of it lets the same frames be run again.
#pragma once

#include <deque>
#include <mutex>

#include "pocd/input/frame.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/frame_queue.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// For two threads, like ObjectPublication: one notes frames, another one writes. Thread-safe.
class FrameLog {
 public:
  FrameLog(const std::shared_ptr<Participant>& participant, std::uint64_t epoch)
      : writer_(participant, topics::kFrames), epoch_(epoch) {}

  void processed(const Frame& frame) {
    note({frame.robot, frame.stamp_ns, !frame.labels.empty(), !frame.color.empty()}, ++order_, 0);
  }
  void dropped(const DroppedFrame& frame) { note(frame, 0, 1); }

  /// Writes what was noted.
  void send() {
    std::deque<pocd_msgs::msg::FrameRecord> records;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      records.swap(waiting_);
    }
    for (auto& record : records) writer_.write(record);
  }
  std::uint64_t failures() const { return writer_.failures(); }
  bool wait_acknowledged(std::chrono::steady_clock::time_point end) {
    return writer_.wait_acknowledged(end);
  }

 private:
  /// A writer that hangs must not cost memory without end.
  static constexpr std::size_t kMostWaiting = 10000;

  void note(const DroppedFrame& frame, std::uint64_t order, std::uint8_t outcome) {
    pocd_msgs::msg::FrameRecord record;
    record.stamp(to_time(frame.stamp_ns));
    record.robot(frame.robot);
    record.epoch(epoch_);
    record.order(order);
    record.outcome(outcome);
    record.with_segmentation(frame.with_segmentation);
    record.with_color(frame.with_color);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (waiting_.size() >= kMostWaiting) waiting_.pop_front();  // a gap in their order tells
    waiting_.push_back(std::move(record));
  }

  Writer<pocd_msgs::msg::FrameRecordPubSubType> writer_;
  const std::uint64_t epoch_;
  std::uint64_t order_ = 0;  // of the thread that notes
  std::mutex mutex_;         // of what follows
  std::deque<pocd_msgs::msg::FrameRecord> waiting_;
};

}  // namespace pocd::dds
