// Objects and events on the bus.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/node_config.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class ObjectPublication {
 public:
  ObjectPublication(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                    std::uint64_t epoch, std::uint64_t lineage = 0);

  /// Events leave at once; an object's state at most once per period.
  void add(const FrameResult& result, StampNs stamp_ns);
  /// Objects that are known from before; once, before all others.
  void restore(const std::vector<ObjectSnapshot>& objects, StampNs stamp_ns);
  /// Sends states that are due, or all that are left with `now`.
  void send_due(bool now);
  bool wait_acknowledged(std::chrono::steady_clock::time_point end);

  const std::map<ObjectId, ObjectSnapshot>& objects() const { return objects_; }
  /// Objects that are new, have changed or have gone; for the reader to empty.
  std::set<ObjectId>& touched() { return touched_; }
  std::uint64_t failures() const { return states_.failures() + events_.failures(); }

 private:
  void dispose_gone();

  const NodeConfig node_;
  const ClassMap classes_;
  const MapRun run_;
  Writer<pocd_msgs::msg::ObjectStatePubSubType> states_;
  Writer<pocd_msgs::msg::ObjectEventPubSubType> events_;
  std::map<ObjectId, ObjectSnapshot> objects_;
  std::set<ObjectId> changed_, published_, gone_, touched_;
  StampNs stamp_ns_ = 0;
  std::optional<StampNs> known_until_ns_;  // from the memory; later sights are of this run
  std::chrono::steady_clock::time_point last_sent_{};
};

}  // namespace pocd::dds
