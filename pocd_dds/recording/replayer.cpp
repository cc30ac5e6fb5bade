#include "pocd_dds/recording/replayer.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd/recording/recording_files.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/recording/keyboard.hpp"
#include "pocd_dds/recording/raw_writer.hpp"
#include "pocd_dds/recording/replay_topics.hpp"
#include "rosgraph_msgsPubSubTypes.h"

namespace pocd::dds {
namespace {

using Clock = std::chrono::steady_clock;
using recording::RecordedChannel;
using recording::RecordedMessage;
using recording::RecordingReader;
constexpr std::chrono::milliseconds kPoll{20};
constexpr std::chrono::milliseconds kLastAcknowledgement{30000};
// Long enough for a busy subscriber to see that the writers of the round before have gone.
constexpr std::chrono::seconds kBetweenRounds{1};

/// Where the messages of one channel go.
struct Route {
  PayloadWriter* writer = nullptr;  // none: they are not played
  bool instances = false;
};

/// The speed of time: log times to moments, with pauses taken out.
class ReplayPace {
 public:
  explicit ReplayPace(std::optional<double> speed) : speed_(speed) {}
  void start(std::uint64_t log_ns) {
    first_ns_ = log_ns;
    start_ = Clock::now();
  }
  void shift(Clock::duration by) { start_ += by; }
  Clock::time_point due(std::uint64_t log_ns) const {
    if (!speed_ || log_ns <= first_ns_) return start_;
    const double seconds = static_cast<double>(log_ns - first_ns_) * 1e-9 / *speed_;
    return start_ +
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }
  bool held() const { return speed_.has_value(); }

 private:
  std::optional<double> speed_;
  std::uint64_t first_ns_ = 0;
  Clock::time_point start_{};
};

}  // namespace

struct Replayer::Impl {
  explicit Impl(const ReplayOptions& replay_options);

  void make_writers();
  void next_round(const std::atomic<bool>& stop);
  Route route_of(const RecordedChannel& channel) const;
  void select(RecordingReader& reader, bool latched_only) const;
  std::string waiting() const;
  bool wait_for_readers(const std::atomic<bool>& stop);
  void report_problems(std::size_t file, const RecordingReader& reader);
  void play_pass(const std::atomic<bool>& stop);
  void play_latched(RecordingReader& reader, std::uint64_t before_ns,
                    const std::atomic<bool>& stop);
  void send(RecordingReader& reader, const RecordedMessage& message, const std::atomic<bool>& stop);
  void wait_until_due(std::uint64_t log_ns, const std::atomic<bool>& stop);
  static bool acknowledged(PayloadWriter& writer, const std::atomic<bool>& stop,
                           Clock::time_point deadline = Clock::time_point::max());

  ReplayOptions options;
  std::shared_ptr<Participant> participant;
  recording::RecordingFiles files;
  std::vector<std::uint64_t> told;  // problems of each file
  ReplayTopics topics;
  std::map<ReplayTopics::Key, std::unique_ptr<PayloadWriter>> writers;
  std::vector<Route> routes;  // of the file being played, by channel
  std::unique_ptr<Writer<rosgraph_msgs::msg::ClockPubSubType>> clock;
  std::uint64_t start_ns = 0;
  ReplayPace pace;
  bool paced = false;
  Keyboard keyboard;
  ReplayResult result;
};

Replayer::Impl::Impl(const ReplayOptions& replay_options)
    : options(replay_options),
      files(options.inputs),
      told(files.size()),
      topics(options),
      pace(options.speed),
      keyboard(options.keyboard) {
  if (files.size() == 0) throw InputError("no recording given");
  bool first = true;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const RecordingReader& reader = files.reader(i);
    report_problems(i, reader);
    for (const RecordedChannel& channel : reader.channels()) topics.add(channel);
    if (first && reader.info().messages > 0) {
      start_ns = reader.info().start_ns;
      first = false;
    }
  }
  topics.refuse_typos();
  if (topics.played().empty()) {
    throw InputError(files.path(0).string() + ": holds no topic that can be played");
  }
  participant = std::make_shared<Participant>(options.bus);
  if (options.clock && topics.played().count({"rt/clock", {}}) == 0) {
    clock =
        std::make_unique<Writer<rosgraph_msgs::msg::ClockPubSubType>>(participant, topics::kClock);
  }
  make_writers();
}

/// Each once, however often the file is played.
void Replayer::Impl::report_problems(std::size_t file, const RecordingReader& reader) {
  const auto& problems = reader.problems();
  for (std::size_t i = told[file]; i < problems.size(); ++i) spdlog::warn("{}", problems[i]);
  if (reader.problem_count() <= told[file]) return;
  result.problems += reader.problem_count() - told[file];
  told[file] = reader.problem_count();
}

void Replayer::Impl::make_writers() {
  // Latched topics last: endpoints are announced in the order of their making, so a reader that
  // acknowledges one of them (tf_static is a recording's first message) knows all others.
  for (const bool latched : {false, true}) {
    for (const auto& [key, topic] : topics.played()) {
      if (topic.transient_local != latched) continue;
      writers.emplace(key, std::make_unique<PayloadWriter>(participant, topics.renamed(topic),
                                                           options.lossless));
    }
  }
}

Route Replayer::Impl::route_of(const RecordedChannel& channel) const {
  std::optional<RecordedTopic> topic = topic_of(channel);
  if (!topic) return {};
  const std::string of = instances_of(channel);
  const bool instances = !of.empty();
  if (instances) topic->name = (of.rfind('/', 0) == 0 ? "rt" : "") + of;
  const ReplayTopics::Key key{topic->name, topic->partitions};
  const auto writer = writers.find(key);
  if (writer == writers.end() || !(instances || topics.played().at(key).type == topic->type))
    return {};
  return {writer->second.get(), instances};
}

void Replayer::Impl::select(RecordingReader& reader, bool latched_only) const {
  reader.select([this, latched_only](const RecordedChannel& channel) {
    const PayloadWriter* writer = route_of(channel).writer;
    return writer != nullptr && (!latched_only || writer->topic().transient_local);
  });
}

/// What is waited for; "" when everything is there.
std::string Replayer::Impl::waiting() const {
  bool any = false;
  std::string missing;
  const auto wanted = [&](const RecordedTopic& topic) {
    if (!options.wait_for.empty()) {
      return std::any_of(options.wait_for.begin(), options.wait_for.end(),
                         [&](const std::string& pattern) { return topic_matches(pattern, topic); });
    }
    const std::string tail = "/depth/image_raw";
    return topic.name.size() > tail.size() &&
           topic.name.compare(topic.name.size() - tail.size(), tail.size(), tail) == 0;
  };
  bool named = false;
  for (const auto& [key, writer] : writers) {
    any = any || writer->matched() >= options.readers;
    if (!wanted(topics.played().at(key))) continue;
    named = true;
    if (writer->matched() < options.readers) missing = writer->topic().name;
  }
  if (named) return missing;
  return any ? "" : "any topic";
}

bool Replayer::Impl::wait_for_readers(const std::atomic<bool>& stop) {
  std::string told;
  while (!stop) {
    const std::string missing = waiting();
    if (missing.empty()) return true;
    if (missing != told) spdlog::info("waiting for a reader of {}", missing);
    told = missing;
    std::this_thread::sleep_for(kPoll);
  }
  return false;
}

bool Replayer::Impl::acknowledged(PayloadWriter& writer, const std::atomic<bool>& stop,
                                  Clock::time_point deadline) {
  while (!stop && Clock::now() < deadline) {
    if (writer.wait_acknowledged(std::chrono::milliseconds(100))) return true;
  }
  return false;
}

void Replayer::Impl::wait_until_due(std::uint64_t log_ns, const std::atomic<bool>& stop) {
  bool paused = false;
  while (!stop) {
    if (keyboard.space_pressed()) {
      paused = !paused;
      spdlog::info(paused ? "paused, space goes on" : "going on");
    }
    const auto now = Clock::now();
    if (!paused && (!pace.held() || now >= pace.due(log_ns))) return;
    if (paused) {
      std::this_thread::sleep_for(kPoll);
      pace.shift(Clock::now() - now);
    } else {
      std::this_thread::sleep_for(std::min<Clock::duration>(pace.due(log_ns) - now, kPoll));
    }
  }
}

void Replayer::Impl::send(RecordingReader& reader, const RecordedMessage& message,
                          const std::atomic<bool>& stop) {
  const RecordedChannel& channel = reader.channels()[message.channel];
  while (routes.size() <= message.channel) {
    routes.push_back(route_of(reader.channels()[routes.size()]));
  }
  const auto [writer, instances] = routes[message.channel];
  if (writer == nullptr) return;
  const bool reliable = options.lossless || writer->topic().reliable;
  if (instances) {
    try {
      const auto [change, key] = parse_instance(message.data, message.size);
      // An instance from before the start was never written here: there is nothing to take back.
      if (writer->change(change, key) && change != InstanceChange::kWritten) {
        ++result.instance_changes;
      }
    } catch (const recording::DamagedData& damage) {
      spdlog::warn("{}: {}", channel.topic, damage.what());
    }
    return;
  }
  // Held back by the slowest reader, rather than overwritten under it.
  if (options.lossless && !acknowledged(*writer, stop)) return;
  if (writer->write(message.data, message.size)) {
    ++result.messages;
  } else if (result.failures++ == 0) {
    spdlog::error("{}: a message of {} bytes was refused by Fast DDS", channel.topic, message.size);
  }
  // See make_writers: what comes after a latched sample is not sent before everybody listens.
  if (reliable && writer->topic().transient_local && !writer->topic().keyed) {
    acknowledged(*writer, stop, Clock::now() + std::chrono::seconds(10));
  }
}

void Replayer::Impl::play_latched(RecordingReader& reader, std::uint64_t before_ns,
                                  const std::atomic<bool>& stop) {
  select(reader, true);
  reader.seek(0);
  RecordedMessage message;
  while (!stop && reader.next(message) && message.log_time_ns < before_ns) {
    send(reader, message, stop);
  }
}

void Replayer::Impl::play_pass(const std::atomic<bool>& stop) {
  const auto from_ns = start_ns + static_cast<std::uint64_t>(options.start_s * 1e9);
  const std::uint64_t until_ns =
      options.duration_s ? from_ns + static_cast<std::uint64_t>(*options.duration_s * 1e9)
                         : std::numeric_limits<std::uint64_t>::max();
  paced = false;
  for (std::size_t i = 0; i < files.size(); ++i) {
    RecordingReader& reader = files.reader(i);
    if (reader.info().start_ns > until_ns) continue;
    routes.clear();
    // A late start misses nothing that a late joiner would have got.
    if (options.start_s > 0.0) play_latched(reader, from_ns, stop);
    select(reader, false);
    reader.seek(from_ns);
    RecordedMessage message;
    while (!stop && reader.next(message) && message.log_time_ns <= until_ns) {
      if (!paced) pace.start(message.log_time_ns);
      paced = true;
      wait_until_due(message.log_time_ns, stop);
      if (stop) break;
      if (clock) {
        rosgraph_msgs::msg::Clock now;
        now.clock(to_time(static_cast<StampNs>(message.log_time_ns)));
        clock->write(now);
      }
      const auto before = Clock::now();
      send(reader, message, stop);
      // A barrier took its time from everybody.
      const auto took = Clock::now() - before;
      if (took > kPoll) pace.shift(took);
    }
    report_problems(i, reader);
    if (stop) return;
  }
}

/// Stamps go back to the beginning, which subscribers take of a new source only.
void Replayer::Impl::next_round(const std::atomic<bool>& stop) {
  const auto deadline = Clock::now() + kLastAcknowledgement;
  for (const auto& [key, writer] : writers) {
    const bool reliable = options.lossless || writer->topic().reliable;
    if (reliable) acknowledged(*writer, stop, deadline);
  }
  writers.clear();
  const auto until = Clock::now() + kBetweenRounds;
  while (!stop && Clock::now() < until) std::this_thread::sleep_for(kPoll);
  make_writers();
  if (options.wait_for_readers) wait_for_readers(stop);
}

Replayer::Replayer(const ReplayOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Replayer::~Replayer() = default;

ReplayResult Replayer::run(const std::atomic<bool>& stop) {
  Impl& replay = *impl_;
  if (!replay.options.wait_for_readers || replay.wait_for_readers(stop)) {
    replay.play_pass(stop);
    while (replay.options.loop && !stop && replay.result.messages > 0) {
      replay.next_round(stop);
      replay.play_pass(stop);
    }
  }
  replay.keyboard.release();  // a second signal would not
  replay.result.stopped = stop;
  const auto deadline = Clock::now() + kLastAcknowledgement;
  for (const auto& [key, writer] : replay.writers) {
    const bool reliable = replay.options.lossless || writer->topic().reliable;
    if (!stop && reliable && !Impl::acknowledged(*writer, stop, deadline)) {
      replay.result.acknowledged = false;
    }
  }
  return replay.result;
}

}  // namespace pocd::dds
