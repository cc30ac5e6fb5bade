#include "view/relay.hpp"

#include "pocd_dds/entities/reader.hpp"

namespace pocd::view {
namespace {

constexpr std::chrono::milliseconds kIdle{100};
constexpr int kMost = 100;  // samples of a topic in one turn

}  // namespace

class Relay::AnyReader : public dds::RawReader {
 public:
  AnyReader(const std::shared_ptr<dds::Participant>& participant, const dds::TopicSpec& spec,
            dds::Wakeup& wakeup)
      : RawReader(participant, spec, spec.name,
                  eprosima::fastdds::dds::TypeSupport(new dds::RawType(spec.type, spec.keyed, {})),
                  spec.delivery, wakeup) {}
  bool take(dds::RawSample& sample, dds::SampleMeta& meta) { return take_raw(&sample, meta); }
};

namespace {

const std::vector<const dds::TopicSpec*>& relayed() {
  using namespace dds::topics;  // NOLINT: a list of them
  static const std::vector<const dds::TopicSpec*> list{&kMarkers, &kOccupancy,   &kOccupancyUpdates,
                                                       &kSurface, &kDiagnostics, &kRmfObstacles,
                                                       &kTf,      &kTfStatic};
  return list;
}

}  // namespace

Relay::Relay(dds::BusOptions bus) : bus_(std::move(bus)), taps_(relayed().size()) {
  bus_.name = "pocd_view_relay";
  for (const dds::TopicSpec* spec : relayed()) {
    RelayedTopic topic;
    topic.topic.name = spec->name;
    topic.topic.type = spec->type;
    topic.topic.transient_local = spec->delivery.transient_local;
    topic.schema = dds::schema_of(topic.topic);
    topics_.push_back(std::move(topic));
  }
}

Relay::~Relay() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  wakeup_.wake();
  if (thread_.joinable()) thread_.join();
}

void Relay::set_listener(std::function<void()> changed) {
  const std::lock_guard<std::mutex> lock(mutex_);
  listener_ = std::move(changed);
}

void Relay::want(std::size_t index) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Tap& tap = taps_.at(index);
  if (tap.wanted == 0) {
    if (!participant_) {
      participant_ = std::make_shared<dds::Participant>(bus_);
    }
    tap.reader = std::make_unique<AnyReader>(participant_, *relayed()[index], wakeup_);
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  }
  ++tap.wanted;
}

void Relay::unwant(std::size_t index) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Tap& tap = taps_.at(index);
  if (--tap.wanted > 0) return;
  tap.reader.reset();
  tap.samples.clear();
  tap.bytes = 0;
}

std::uint64_t Relay::begin(std::size_t index) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Tap& tap = taps_.at(index);
  const bool last = topics_[index].topic.transient_local && !tap.samples.empty();
  return tap.newest - (last ? 1 : 0);
}

RelayedSample Relay::after(std::size_t index, std::uint64_t number) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const RelayedSample& sample : taps_.at(index).samples) {
    if (sample.number > number) return sample;
  }
  return {};
}

bool Relay::drain(Tap& tap) {
  dds::RawSample sample;
  dds::SampleMeta meta;
  bool some = false;
  for (int i = 0; i < kMost && tap.reader->take(sample, meta); ++i) {
    if (!meta.valid) continue;
    some = true;
    tap.bytes += sample.payload.size();
    tap.samples.push_back(
        {++tap.newest, std::make_shared<const recording::Bytes>(std::move(sample.payload))});
    sample.payload = {};
    while (tap.samples.size() > kMostSamples ||
           (tap.bytes > kMostBytes && tap.samples.size() > 1)) {
      tap.bytes -= tap.samples.front().payload->size();
      tap.samples.pop_front();
    }
  }
  return some;
}

void Relay::run() {
  while (true) {
    wakeup_.wait_for(kIdle);
    std::function<void()> listener;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (stopping_) return;
      bool some = false;
      for (Tap& tap : taps_) {
        if (tap.reader) some = drain(tap) || some;
      }
      if (some) listener = listener_;
    }
    if (listener) listener();
  }
}

}  // namespace pocd::view
