#include "pocd_dds/node/event_feed.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"

namespace pocd::dds {
namespace {

constexpr int kMostRequests = 4;  // in one turn: each reads from the disk

}  // namespace

EventFeed::EventFeed(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                     Wakeup& wakeup)
    : config_(config),
      replies_(participant, topics::kEventsReply),
      requests_(participant, topics::kEventsRequest, wakeup) {}

void EventFeed::answer() {
  requests_.take_some(kMostRequests, [&](const auto& request, const SampleMeta& meta) {
    if (!meta.valid || request.map_id() != static_cast<std::uint32_t>(config_.node.map_id)) return;
    answer(request);
  });
}

void EventFeed::answer(const pocd_msgs::msg::EventsRequest& request) {
  pocd_msgs::msg::EventsReply reply;
  reply.requester(request.requester());
  reply.map_id(request.map_id());
  reply.after_seq(request.after_seq());
  try {
    if (!log_) log_ = std::make_unique<MemoryReader>(config_.node.memory.folder);
    reply.lineage(log_->lineage());
    const auto [first, last] = log_->range();
    reply.first_seq(first);
    reply.last_seq(last);
    const std::uint32_t most = std::clamp<std::uint32_t>(request.most(), 1, kMostEvents);
    for (const LoggedEvent& logged : log_->events(request.after_seq(), most)) {
      if (epoch_of_run_.count(logged.run) == 0) {
        for (const LoggedRun& run : log_->runs()) epoch_of_run_[run.run] = run.epoch;
      }
      const MapRun run{request.map_id(), epoch_of_run_[logged.run], log_->lineage()};
      reply.events().push_back(
          event_message(logged.event, run, config_.pipeline.classes, config_.node.map_frame));
    }
  } catch (const InputError& error) {
    log_.reset();
    reply.events().clear();
    reply.problem(error.what());
  }
  replies_.write(reply);
}

void EventFeed::count_problems(ProblemCounter& problems) {
  problems.count_incompatible(requests_);
  problems.count_damaged(requests_);
}

}  // namespace pocd::dds
