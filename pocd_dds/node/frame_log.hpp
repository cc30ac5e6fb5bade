// Publishes what became of every frame: a recording of it lets the same frames be run again.
#pragma once

#include "pocd/input/frame.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/frame_queue.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class FrameLog {
 public:
  FrameLog(const std::shared_ptr<Participant>& participant, std::uint64_t epoch)
      : writer_(participant, topics::kFrames), epoch_(epoch) {}

  void processed(const Frame& frame) {
    write({frame.robot, frame.stamp_ns, !frame.labels.empty(), !frame.color.empty()}, ++order_, 0);
  }
  void dropped(const DroppedFrame& frame) { write(frame, 0, 1); }

  std::uint64_t failures() const { return writer_.failures(); }
  bool wait_acknowledged(std::chrono::steady_clock::time_point end) {
    return writer_.wait_acknowledged(end);
  }

 private:
  void write(const DroppedFrame& frame, std::uint64_t order, std::uint8_t outcome) {
    pocd_msgs::msg::FrameRecord record;
    record.stamp(to_time(frame.stamp_ns));
    record.robot(frame.robot);
    record.epoch(epoch_);
    record.order(order);
    record.outcome(outcome);
    record.with_segmentation(frame.with_segmentation);
    record.with_color(frame.with_color);
    writer_.write(record);
  }

  Writer<pocd_msgs::msg::FrameRecordPubSubType> writer_;
  std::uint64_t epoch_;
  std::uint64_t order_ = 0;
};

}  // namespace pocd::dds
