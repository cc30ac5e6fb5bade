#include "pocd_dds/recording/recorder.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <set>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd_dds/entities/wakeup.hpp"
#include "pocd_dds/recording/discovery.hpp"
#include "pocd_dds/recording/latched_samples.hpp"
#include "pocd_dds/recording/record_queue.hpp"
#include "pocd_dds/recording/rerun_form.hpp"
#include "pocd_dds/recording/tap.hpp"

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else

namespace {

/// The file, when no recording is lost by it. What is replaced goes as a whole: of a longer split
/// recording no file is left beside those of the new one.
const std::filesystem::path& checked(const RecorderOptions& options) {
  if (options.split.keep_bytes > 0 && !options.overwrite) return options.output;  // it goes on
  for (const std::filesystem::path& file :
       recording::SplitWriter::existing(options.output, options.split)) {
    if (!options.overwrite) {
      throw InputError(file.string() + " exists already; --overwrite replaces it");
    }
    std::error_code error;
    if (!std::filesystem::remove(file, error)) {
      throw InputError(file.string() + ": cannot be replaced: " + error.message());
    }
  }
  return options.output;
}

}  // namespace

struct Recorder::Impl {
  explicit Impl(const RecorderOptions& recorder_options)
      : options(recorder_options),
        queue(options.queue_bytes),
        writer(checked(options), options.split),
        discovery([this] { wakeup.wake(); }) {
    BusOptions bus = options.bus;
    bus.listener = &discovery;
    participant = std::make_shared<Participant>(bus);
    thread = std::thread([this] { write_all(); });
  }

  ~Impl() {
    close_readers();
    queue.close();
    if (thread.joinable()) thread.join();
    participant->get()->set_listener(nullptr);
  }

  struct Line {
    RecordedTopic topic;  // the weakest quality of service seen
    std::uint16_t channel = 0;
    std::optional<std::uint16_t> instances;
    std::shared_ptr<Topic> use;
    Subscriber* subscriber = nullptr;
    DataReader* reader = nullptr;
    std::unique_ptr<Tap> tap;
  };

  void consider(const RecordedTopic& topic);
  std::uint16_t add_channel(const recording::SchemaText& schema, const std::string& name,
                            const std::map<std::string, std::string>& metadata);
  void add_rerun_form(const RecordedTopic& topic, std::uint16_t channel,
                      const std::map<std::string, std::string>& metadata);
  void write_for_rerun(QueuedSample& sample);
  void open_reader(Line& line);
  void close_reader(Line& line);
  void close_readers();
  void write_all();
  void rethrow_failure();

  const RecorderOptions options;
  Wakeup wakeup;
  RecordQueue queue;
  ReceivedCounts counts;
  mutable std::mutex writer_mutex;
  recording::SplitWriter writer;
  std::map<std::string, std::uint16_t> schemas;
  struct Converted {
    std::string topic;
    RerunForm form;
    std::optional<std::uint16_t> channel;  // of a second topic
    std::set<std::string> told;            // of what is left out
  };
  std::map<std::uint16_t, Converted> converted;  // by channel; guarded as the writer is
  std::exception_ptr failure;
  std::atomic<bool> failed{false};

  Discovery discovery;
  std::shared_ptr<Participant> participant;
  std::map<std::pair<std::string, std::vector<std::string>>, Line> lines;
  std::set<std::string> refused;
  std::thread thread;
};

void Recorder::Impl::consider(const RecordedTopic& topic) {
  const auto matches = [&](const std::string& pattern) { return topic_matches(pattern, topic); };
  if (!std::any_of(options.topics.begin(), options.topics.end(), matches) ||
      std::any_of(options.exclude.begin(), options.exclude.end(), matches)) {
    return;
  }
  const auto named = [&](const std::string& pattern) { return pattern != "*" && matches(pattern); };
  if (is_of_the_ros_graph(topic.name) &&
      std::none_of(options.topics.begin(), options.topics.end(), named)) {
    if (refused.insert(topic.name).second) {
      spdlog::info("{}: is left out (--topic records it)", topic.name);
    }
    return;
  }
  const auto [entry, fresh] = lines.try_emplace({topic.name, topic.partitions});
  Line& line = entry->second;
  if (!fresh) {
    // A reader that asks for more than one of the writers offers would not hear that one.
    const bool weaker = (line.topic.reliable && !topic.reliable) ||
                        (line.topic.transient_local && !topic.transient_local);
    if (topic.type != line.topic.type || topic.keyed != line.topic.keyed) {
      if (refused.insert(topic.name + " " + topic.type).second) {
        spdlog::warn("{}: has a writer of another type, {}; it is not recorded", topic.name,
                     topic.type);
      }
      return;
    }
    if (!weaker) return;
    spdlog::warn("{}: has writers of different quality of service; recording with the weaker one",
                 topic.name);
    line.topic.reliable = line.topic.reliable && topic.reliable;
    line.topic.transient_local = line.topic.transient_local && topic.transient_local;
    close_reader(line);
    open_reader(line);
    return;
  }
  line.topic = topic;
  const auto metadata = metadata_of(topic);
  line.channel = add_channel(schema_of(topic), recorded_name(topic.name), metadata);
  if (topic.keyed) {
    line.instances = add_channel(
        instances_schema(), instances_name(topic),
        {{"instances_of", recorded_name(topic.name)}, {"partitions", metadata.at("partitions")}});
  }
  if (options.rerun) add_rerun_form(topic, line.channel, metadata);
  open_reader(line);
  spdlog::info("recording {} ({})", recorded_name(topic.name), plain_type(topic.type));
}

std::uint16_t Recorder::Impl::add_channel(const recording::SchemaText& schema,
                                          const std::string& name,
                                          const std::map<std::string, std::string>& metadata) {
  const std::lock_guard<std::mutex> lock(writer_mutex);
  const auto known = schemas.find(schema.name);
  const std::uint16_t id = known != schemas.end()
                               ? known->second
                               : writer.add_schema(schema.name, schema.encoding, schema.text);
  schemas[schema.name] = id;
  return writer.add_channel(id, name, "cdr", metadata);
}

void Recorder::Impl::add_rerun_form(const RecordedTopic& topic, std::uint16_t channel,
                                    const std::map<std::string, std::string>& metadata) {
  std::optional<RerunForm> form = RerunForm::of(topic);
  if (!form) return;
  std::optional<std::uint16_t> second;
  if (const auto schema = form->second()) {
    second = add_channel(
        *schema, RerunForm::second_name(topic),
        {{kMadeOf, recorded_name(topic.name)}, {"partitions", metadata.at("partitions")}});
  }
  const std::lock_guard<std::mutex> lock(writer_mutex);
  converted.emplace(channel, Converted{recorded_name(topic.name), std::move(*form), second, {}});
}

/// Changes the sample, or writes another one beside it.
void Recorder::Impl::write_for_rerun(QueuedSample& sample) {
  const auto found = converted.find(sample.header.channel);
  if (found == converted.end()) return;
  std::optional<recording::Bytes> made = found->second.form.convert(sample.payload);
  for (const auto& [what, count] : found->second.form.left_out()) {
    if (!found->second.told.insert(what).second) continue;
    spdlog::warn("{}: Rerun will not show {} (the recording has them)", found->second.topic, what);
  }
  if (!made) return;
  if (!found->second.channel) {
    sample.payload = std::move(*made);
    return;
  }
  recording::MessageHeader header = sample.header;
  header.channel = *found->second.channel;
  writer.write(header, made->data(), made->size());
}

void Recorder::Impl::open_reader(Line& line) {
  const RecordedTopic& topic = line.topic;
  try {
    const KeyOf key = key_of(topic.type);
    line.use =
        participant->topic(topic.name, TypeSupport(new RawType(topic.type, topic.keyed, key)));
    SubscriberQos subscriber_qos = SUBSCRIBER_QOS_DEFAULT;
    for (const std::string& partition : topic.partitions) {
      subscriber_qos.partition().push_back(partition.c_str());
    }
    line.subscriber = participant->get()->create_subscriber(subscriber_qos);
    if (line.subscriber == nullptr) throw InputError("cannot create a subscriber");
    // Taken as they come, so the history holds next to nothing; but it may not leave out anything.
    Delivery delivery;
    delivery.reliable = topic.reliable;
    delivery.transient_local = topic.transient_local;
    delivery.keep_last = 0;
    DataReaderQos qos = participant->reader_qos(topic.name, delivery);
    // Brings the instance's handle with every sample: a type that is not known has no other way to
    // tell.
    qos.expects_inline_qos(topic.keyed);
    if (topic.exclusive) qos.ownership().kind = EXCLUSIVE_OWNERSHIP_QOS;
    line.tap =
        std::make_unique<Tap>(queue, counts, line.channel, line.instances, static_cast<bool>(key),
                              topic.transient_local && options.split.splits());
    line.reader = participant->make_reader(*line.subscriber, *line.use, qos, *line.tap);
    if (line.reader == nullptr) throw InputError("cannot create a reader");
  } catch (const InputError& error) {
    spdlog::error("{}: is not recorded: {}", topic.name, error.what());
  }
}

void Recorder::Impl::close_reader(Line& line) {
  if (line.reader != nullptr) participant->delete_reader(*line.subscriber, *line.reader);
  if (line.subscriber != nullptr) {
    const_cast<DomainParticipant*>(line.subscriber->get_participant())
        ->delete_subscriber(line.subscriber);
  }
  line.reader = nullptr;
  line.subscriber = nullptr;
  line.use.reset();
}

void Recorder::Impl::close_readers() {
  for (auto& [name, line] : lines) close_reader(line);
}

void Recorder::Impl::write_all() {
  using Clock = std::chrono::steady_clock;
  auto flushed = Clock::now();
  const auto period = std::chrono::duration<double>(options.flush_period_s);
  LatchedSamples latched;
  writer.set_head([&](const recording::SplitWriter::Write& write) {
    latched.write_all([&](const QueuedSample& sample) {
      write(sample.header, sample.payload.data(), sample.payload.size());
    });
  });
  bool told = false;  // that the ring is larger than asked for
  try {
    while (!queue.finished()) {
      std::optional<QueuedSample> sample = queue.pop(std::chrono::milliseconds(100));
      const std::lock_guard<std::mutex> lock(writer_mutex);
      if (sample && !sample->is_message()) {
        latched.note(*sample);
      } else if (sample) {
        if (!converted.empty()) write_for_rerun(*sample);
        writer.write(sample->header, sample->payload.data(), sample->payload.size());
        latched.note(*sample);
        queue.give_back(std::move(sample->payload));
      }
      if (Clock::now() - flushed >= period) {
        writer.flush();
        flushed = Clock::now();
        if (!told && !writer.problem().empty()) {
          spdlog::warn("{}", writer.problem());
          told = true;
        }
      }
    }
    const std::lock_guard<std::mutex> lock(writer_mutex);
    writer.close();
    if (!writer.listed()) {
      spdlog::warn("metadata.yaml beside {} lists other files: rosbag2 will not find these",
                   options.output.string());
    }
  } catch (...) {
    failure = std::current_exception();
    failed = true;
    wakeup.wake();
  }
}

void Recorder::Impl::rethrow_failure() {
  if (!failed) return;
  if (thread.joinable()) thread.join();
  std::rethrow_exception(failure);
}

Recorder::Recorder(const RecorderOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Recorder::~Recorder() = default;

void Recorder::step(std::chrono::milliseconds time) {
  impl_->wakeup.wait_for(time);
  impl_->rethrow_failure();
  for (const RecordedTopic& topic : impl_->discovery.take()) impl_->consider(topic);
}

void Recorder::stop() {
  impl_->close_readers();
  impl_->queue.close();
  if (impl_->thread.joinable()) impl_->thread.join();
  impl_->rethrow_failure();
}

RecorderStatus Recorder::status() const {
  RecorderStatus status;
  status.messages = impl_->counts.messages;
  status.bytes = impl_->counts.bytes;
  status.lost = impl_->counts.lost;
  status.dropped = impl_->queue.dropped();
  status.waiting_bytes = impl_->queue.bytes();
  status.topics = impl_->lines.size();
  const std::lock_guard<std::mutex> lock(impl_->writer_mutex);
  status.file_bytes = impl_->writer.bytes_written();
  status.files = impl_->writer.files().size();
  for (const auto& [channel, converted] : impl_->converted) {
    for (const auto& [what, count] : converted.form.left_out()) {
      status.left_out_for_rerun[converted.topic + ": " + what] += count;
    }
  }
  return status;
}

}  // namespace pocd::dds
