#include "pocd_dds/node/command_desk.hpp"

#include <algorithm>

namespace pocd::dds {
namespace {

constexpr int kMostCommands = 20;  // in one turn

/// The object's number; nothing for one of another lineage.
std::optional<ObjectId> object_of(const std::array<std::uint8_t, 16>& uuid, const MapRun& run) {
  std::uint64_t number = 0;
  for (int i = 8; i < 16; ++i) number = number << 8 | uuid[i];
  if (number > 0xFFFFFFFFu) return std::nullopt;
  const auto id = static_cast<ObjectId>(number);
  return object_uuid(run.names(), id) == uuid ? std::make_optional(id) : std::nullopt;
}

bool names_object(WordKind kind) {
  return kind == WordKind::kForgetObject || kind == WordKind::kConfirmRemoval;
}

}  // namespace

CommandDesk::CommandDesk(const std::shared_ptr<Participant>& participant, const MapRun& run,
                         Wakeup& wakeup)
    : run_(run),
      wakeup_(wakeup),
      replies_(participant, topics::kCommandReply),
      commands_(participant, topics::kCommand, wakeup) {}

void CommandDesk::take() {
  commands_.take_some(kMostCommands, [&](const auto& command, const SampleMeta& meta) {
    if (meta.valid && command.map_id() == run_.map_id) take(command);
  });
}

CommandDesk::Case* CommandDesk::find(const Name& name) {
  const auto known =
      std::find_if(cases_.begin(), cases_.end(), [&](const Case& c) { return c.name == name; });
  return known == cases_.end() ? nullptr : &*known;
}

void CommandDesk::take(const pocd_msgs::msg::Command& command) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Name name{command.requester(), command.number()};
  if (Case* known = find(name)) {
    if (known->state == Case::State::kAnswered) replies_.write(known->reply);
    return;
  }
  Case fresh;
  fresh.name = name;
  fresh.reply.requester(command.requester());
  fresh.reply.number(command.number());
  fresh.reply.map_id(run_.map_id);
  std::string wrong;
  if (command.kind() >= kWordKinds) {
    wrong = "kind " + std::to_string(command.kind()) + " is no command";
  } else {
    OperatorWord& word = fresh.word;
    word.kind = static_cast<WordKind>(command.kind());
    word.region = command.region();
    word.by = command.by();
    for (const auto& corner : command.polygon())
      word.polygon_W.emplace_back(corner.x(), corner.y());
    if (names_object(word.kind)) {
      if (const auto id = object_of(command.uuid(), run_)) {
        word.object = *id;
      } else {
        wrong = std::string(to_string(word.kind)) + ": uuid is not of this lineage";
      }
    }
  }
  const auto waiting = std::count_if(cases_.begin(), cases_.end(),
                                     [](const Case& c) { return c.state == Case::State::kWaits; });
  if (wrong.empty() && static_cast<std::size_t>(waiting) >= kMostWaiting) {
    wrong = std::to_string(kMostWaiting) + " commands wait already";
  }
  if (!wrong.empty()) {
    fresh.reply.text(wrong);
    fresh.state = Case::State::kDone;
  }
  cases_.push_back(std::move(fresh));
  forget_old();
}

void CommandDesk::forget_old() {
  while (cases_.size() > kMostRemembered && cases_.front().state == Case::State::kAnswered) {
    cases_.pop_front();
  }
}

std::optional<OperatorWord> CommandDesk::next() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Case& c : cases_) {
    if (c.state != Case::State::kWaits) continue;
    c.state = Case::State::kInWork;
    return c.word;
  }
  return std::nullopt;
}

void CommandDesk::done(const WordOutcome& outcome) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Case& c : cases_) {
    if (c.state != Case::State::kInWork) continue;
    c.reply.done(outcome.done);
    c.reply.text(outcome.text);
    if (outcome.done) c.reply.seq(outcome.result.events.back().sequence);
    c.done_at = std::chrono::steady_clock::now();
    c.state = Case::State::kDone;
  }
  wakeup_.wake();
}

void CommandDesk::answer(const std::optional<MemoryStatus>& kept) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Case& c : cases_) {
    if (c.state != Case::State::kDone) continue;
    const bool stored = kept && c.reply.done() && kept->stored_event >= c.reply.seq();
    const bool may_be = kept && c.reply.done() && !kept->stopped &&
                        std::chrono::steady_clock::now() - c.done_at < kWaitStored;
    if (!stored && may_be) continue;
    c.reply.stored(stored);
    if (c.reply.done() && !stored && (kept || c.word.kind == WordKind::kSave)) {
      c.reply.text(c.reply.text() + "; not on disk: " +
                   (kept ? kept->problem.empty() ? "it takes too long" : kept->problem
                         : "the node has no memory"));
      if (c.word.kind == WordKind::kSave) c.reply.done(false);
    }
    c.state = Case::State::kAnswered;
    replies_.write(c.reply);
  }
}

void CommandDesk::count_problems(ProblemCounter& problems) {
  problems.count_incompatible(commands_);
  problems.count_damaged(commands_);
}

}  // namespace pocd::dds
