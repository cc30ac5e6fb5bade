// Everything that comes in: readers of all robots, merged into one order, handed to the queue.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "pocd/input/frame_merger.hpp"
#include "pocd_dds/node/frame_queue.hpp"
#include "pocd_dds/node/robot_input.hpp"
#include "tf2_msgsPubSubTypes.h"

namespace pocd::dds {

struct RobotStatus {
  std::string name;
  bool live = false;
  std::uint64_t frames = 0, dropped = 0, lost = 0;
  std::string waiting_for;  ///< "" or "waiting for <stream> since <stamp>"
};

struct IntakeStatus {
  std::vector<RobotStatus> robots;
  std::vector<ProblemCounter::Entry> problems;
};

/// Runs a thread of its own from construction to stop().
class Intake {
 public:
  /// `queue` must outlive it. Throws InputError for a bad topic or colour.
  Intake(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
         const ClassMap& classes, FrameQueue& queue);
  ~Intake();

  /// Takes what has arrived until now, hands every frame that it makes to the queue, and closes it.
  void stop();
  /// A frame was taken out of the queue.
  void room_made() { wakeup_.wake(); }
  IntakeStatus status() const;

 private:
  using TfReader = Reader<tf2_msgs::msg::TFMessagePubSubType>;

  void run();
  void step(bool last);
  void drain_transforms(TfReader& reader, bool is_static);
  void hand_over(bool last);
  void update_status();

  const bool lossless_;
  FrameQueue& queue_;
  Wakeup wakeup_;
  ColourTable colours_;
  ProblemCounter problems_;
  std::vector<std::unique_ptr<RobotInput>> robots_;
  TfReader tf_, tf_static_;
  FrameMerger<Frame> merger_;
  std::atomic<bool> stopping_{false};
  mutable std::mutex status_mutex_;
  IntakeStatus status_;
  std::thread thread_;
};

}  // namespace pocd::dds
