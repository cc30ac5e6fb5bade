// The log of events for who asks on the bus.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>

#include "pocd/config/node_config.hpp"
#include "pocd/memory/memory_reader.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Answers requests for the events after a number, from the memory. Not thread-safe.
class EventFeed {
 public:
  static constexpr std::uint32_t kMostEvents = 500;  ///< of one reply

  /// `wakeup` is woken by requests and must outlive it.
  EventFeed(const std::shared_ptr<Participant>& participant, const NodeFile& config,
            Wakeup& wakeup);

  /// Answers a few of those who wait; the others next time.
  void answer();
  void count_problems(ProblemCounter& problems);
  std::uint64_t failures() const { return replies_.failures(); }

 private:
  void answer(const pocd_msgs::msg::EventsRequest& request);

  const NodeFile config_;
  std::unique_ptr<MemoryReader> log_;  // opened when somebody asks
  std::map<std::int64_t, std::uint64_t> epoch_of_run_;
  Writer<pocd_msgs::msg::EventsReplyPubSubType> replies_;
  Reader<pocd_msgs::msg::EventsRequestPubSubType> requests_;
};

}  // namespace pocd::dds
