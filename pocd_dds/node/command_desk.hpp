// What operators ask of the map over the bus.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "pocd/config/node_config.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "pocd/pipeline/operator_word.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Takes commands, hands them to the thread of the pipeline one by one, and answers each when it
/// was done and, with a memory, is on disk. A command is named by its requester and number: one
/// that comes again is answered again and not done again.
class CommandDesk {
 public:
  static constexpr std::size_t kMostWaiting = 100;
  static constexpr std::size_t kMostRemembered = 1000;  ///< answers, for commands that come again
  /// An answer does not wait longer for the disk.
  static constexpr std::chrono::seconds kWaitStored{10};

  /// `run` names the objects that are known. `wakeup` is woken by commands and by what was done,
  /// and must outlive it.
  CommandDesk(const std::shared_ptr<Participant>& participant, const MapRun& run, Wakeup& wakeup);

  // The thread of the bus:

  void take();
  /// Answers what is done. `kept`: how the memory is; without a value there is none.
  void answer(const std::optional<MemoryStatus>& kept);
  void count_problems(ProblemCounter& problems);
  std::uint64_t failures() const { return replies_.failures(); }

  // The thread of the pipeline:

  std::optional<OperatorWord> next();
  /// Of the word that next() gave last.
  void done(const WordOutcome& outcome);

 private:
  using Name = std::pair<std::array<std::uint8_t, 16>, std::uint64_t>;
  struct Case {
    Name name;
    OperatorWord word;
    pocd_msgs::msg::CommandReply reply;
    std::chrono::steady_clock::time_point done_at{};
    enum class State { kWaits, kInWork, kDone, kAnswered } state = State::kWaits;
  };

  void take(const pocd_msgs::msg::Command& command);
  Case* find(const Name& name);
  void forget_old();

  const MapRun run_;
  Wakeup& wakeup_;
  Writer<pocd_msgs::msg::CommandReplyPubSubType> replies_;
  Reader<pocd_msgs::msg::CommandPubSubType> commands_;
  std::mutex mutex_;        // guards what follows
  std::deque<Case> cases_;  // in the order in which they came
};

}  // namespace pocd::dds
