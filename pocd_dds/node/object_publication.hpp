// Objects and events on the bus.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "pocd/config/node_config.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// For two threads: the one of the pipeline adds what has changed, another one writes it. Writing
/// takes as long as there are subscribers, and nobody waits for it.
class ObjectPublication {
 public:
  ObjectPublication(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                    std::uint64_t epoch, std::uint64_t lineage = 0);

  // The thread of the pipeline:

  /// Objects that are known from before; once, before all others.
  void restore(const std::vector<ObjectSnapshot>& objects, StampNs stamp_ns);
  void add(const FrameResult& result, StampNs stamp_ns);

  // The thread that writes:

  /// Events at once, an object's state at most once per period, or all that are left with `now`.
  void send_due(bool now);
  bool wait_acknowledged(std::chrono::steady_clock::time_point end);

  // Any thread:

  /// As long as it is held, objects() and touched() stay as they are.
  [[nodiscard]] std::unique_lock<std::mutex> hold() const {
    return std::unique_lock<std::mutex>(mutex_);
  }
  const std::map<ObjectId, ObjectSnapshot>& objects() const { return objects_; }
  /// Objects that are new, have changed or have gone; for the reader to empty.
  std::set<ObjectId>& touched() { return touched_; }
  std::size_t count() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return objects_.size();
  }
  std::uint64_t failures() const {
    return states_.failures() + events_.failures() +
           (ros_list_ ? ros_list_->failures() + ros_events_->failures() : 0);
  }
  /// Events that were not written because more than kMostEvents waited.
  std::uint64_t dropped_events() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_events_;
  }

 private:
  static constexpr std::size_t kMostEvents = 10000;
  static constexpr std::chrono::seconds kForgottenStays{5};
  static constexpr std::size_t kMostRemovals = 100;  // in a list for ROS 2

  void send_events();
  void dispose_gone();
  /// What an operator had forgotten: said in a last state, which has time to arrive before the
  /// object is disposed.
  void send_forgotten();
  /// Ids of objects whose state is to be written now.
  std::vector<ObjectId> take_due(bool now);
  bool send_state(ObjectId id);
  /// All objects in one message, when one has changed or gone.
  void send_list(bool now);
  void note_removal(ObjectId id, bool forgotten);

  const NodeConfig node_;
  const ClassMap classes_;
  const MapRun run_;
  Writer<pocd_msgs::msg::ObjectStatePubSubType> states_;
  Writer<pocd_msgs::msg::ObjectEventPubSubType> events_;
  // For ROS 2; null when they are off.
  std::unique_ptr<RenamedWriter<pocd_msgs::msg::ObjectListPubSubType>> ros_list_;
  std::unique_ptr<RenamedWriter<pocd_msgs::msg::ObjectEventPubSubType>> ros_events_;

  // Only the thread that writes.
  std::set<ObjectId> published_;
  std::chrono::steady_clock::time_point last_sent_{};
  std::deque<std::pair<ObjectId, std::chrono::steady_clock::time_point>> said_forgotten_;
  std::chrono::steady_clock::time_point list_sent_{};
  std::uint64_t lists_ = 0;

  mutable std::mutex mutex_;  // guards what follows, and is not held while something is written
  std::map<ObjectId, ObjectSnapshot> objects_;
  std::set<ObjectId> changed_, gone_, touched_;
  std::vector<ObjectSnapshot> forgotten_;               // with their last state
  std::deque<pocd_msgs::msg::ObjectRemoval> removals_;  // the last ones, for ROS 2
  bool list_outdated_ = true;                           // that there is nothing is to be said, too
  std::deque<ObjectEvent> events_waiting_;
  std::uint64_t dropped_events_ = 0;
  StampNs stamp_ns_ = 0;
  std::set<ObjectId> unseen_;  // known from the memory, and not seen by this run
};

}  // namespace pocd::dds
