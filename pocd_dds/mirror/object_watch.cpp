#include "pocd_dds/object_watch.hpp"

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <map>
#include <mutex>
#include <set>

#include "mirror/callback_thread.hpp"
#include "mirror/reading_thread.hpp"
#include "mirror/shared_participant.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd {
namespace {

constexpr std::chrono::milliseconds kIdle{50};
constexpr int kMost = 1000;  // samples of a topic in one turn, so that no peer holds up the others

/// With the last sample only, a dispose would take the place of a state that was not read yet, and
/// a state that of the one before. What finds no room is sent again when there is some.
dds::Delivery every_sample(std::size_t most_objects) {
  constexpr int kPerObject = 8, kBeyond = 1000;  // those beyond are counted
  dds::Delivery delivery = dds::topics::kObjects.delivery;
  delivery.keep_last = 0;
  delivery.max_instances =
      static_cast<int>(std::min<std::size_t>(most_objects, 10000000)) + kBeyond;
  delivery.max_samples_per_instance = kPerObject;
  delivery.max_samples = kPerObject * delivery.max_instances;
  return delivery;
}

}  // namespace

struct ObjectWatch::Impl {
  explicit Impl(const ObjectWatchOptions& given)
      : options(given),
        participant(dds::shared_participant(
            {given.domain, given.profiles_file, given.name, given.security_folder})),
        states(participant, dds::topics::kObjects, dds::topics::kObjects.name,
               every_sample(given.most_objects), wakeup),
        events(participant, dds::topics::kObjectEvents, wakeup),
        manifests(participant, dds::topics::kMapManifest, wakeup),
        callbacks(given.callbacks, [this](const std::string& text) { tell(text); }),
        thread([this] { turn(); }, [this](const std::string& text) { tell(text); }) {}
  ~Impl() {
    callbacks.stop_waiting();
    thread.stop([this] { wakeup.wake(); });
  }

  void tell(const std::string& text) const { dds::log_error("{}: {}", options.name, text); }
  void turn();
  void take_states();
  void take_events();
  void take_manifests();
  void forget_replaced();
  /// A run of this lineage goes on and has not told of all its objects yet.
  bool may_still_come(std::uint64_t lineage) const;
  void gone(const std::array<std::uint8_t, 16>& uuid, Gone why);

  struct Known {
    WatchedObject object;
    dds::SampleMeta::Guid writer{};
  };
  const ObjectWatchOptions options;
  dds::Wakeup wakeup;
  std::shared_ptr<dds::Participant> participant;
  dds::Reader<pocd_msgs::msg::ObjectStatePubSubType> states;
  dds::Reader<pocd_msgs::msg::ObjectEventPubSubType> events;
  std::map<std::array<std::uint8_t, 16>, Known> known;
  dds::Reader<pocd_msgs::msg::MapManifestPubSubType> manifests;
  mutable std::mutex mutex;  // guards publishers and counts
  struct Publisher {
    std::uint64_t epoch = 0, lineage = 0;
    std::size_t objects = 0;
  };
  /// By writer of this map's manifest, of runs that go on. Only the thread changes it.
  std::map<dds::SampleMeta::Guid, Publisher> publishers;
  std::pair<int, int> matched_before{0, 0};
  dds::ProblemCounter problems;  // tells of the first
  std::uint64_t too_many = 0;
  WatchStatus counts;
  dds::CallbackThread callbacks;
  dds::ReadingThread thread;
};

void ObjectWatch::Impl::turn() {
  wakeup.wait_for(kIdle);
  take_states();
  take_events();
  take_manifests();
  std::string refused;
  for (dds::RawReader* reader :
       std::initializer_list<dds::RawReader*>{&states, &events, &manifests}) {
    problems.count_damaged(*reader);
    if (!reader->misread_from().empty()) refused = reader->topic() + ": " + reader->misread_from();
  }
  const std::lock_guard<std::mutex> lock(mutex);
  counts.objects = known.size();
  counts.too_many = too_many;
  counts.corrupt = problems.total();
  counts.refused = std::move(refused);
}

void ObjectWatch::Impl::take_states() {
  bool taken = false;
  states.take_some(kMost, [&](const auto& state, const dds::SampleMeta& meta) {
    if (meta.disposed) gone(meta.key, Gone::kRemoved);
    // Not valid and not disposed: its node has gone, which says nothing about the object.
    if (!meta.valid || state.map_id() != options.map_id) return;
    if (state.forgotten()) return gone(state.uuid(), Gone::kForgotten);
    if (known.size() >= options.most_objects && known.count(state.uuid()) == 0) {
      if (too_many++ == 0) tell("more than most_objects are on the bus (said once, counted)");
      return;
    }
    taken = true;
    Known& entry = known[state.uuid()];
    entry = {
        {state.uuid(), state.epoch(), state.lineage(), state.class_name(), dds::object_from(state)},
        meta.writer};
    if (!options.on_object) return;
    callbacks.call([this, object = entry.object] { options.on_object(object); });
  });
  // The bus may tell of a writer after its first sample.
  const std::pair<int, int> matched{states.matched(), states.ever_matched()};
  if (taken || matched != matched_before) forget_replaced();
  matched_before = matched;
}

bool ObjectWatch::Impl::may_still_come(std::uint64_t lineage) const {
  for (const auto& [writer, publisher] : publishers) {
    if (publisher.lineage != lineage || !manifests.has_writer(writer)) continue;
    std::size_t told = 0;
    for (const auto& entry : known) told += entry.second.object.epoch == publisher.epoch;
    return told < publisher.objects;
  }
  // Its objects may be heard before its manifest.
  return std::any_of(known.begin(), known.end(), [&](const auto& entry) {
    return entry.second.object.lineage == lineage && states.has_writer(entry.second.writer);
  });
}

void ObjectWatch::Impl::forget_replaced() {
  std::vector<std::array<std::uint8_t, 16>> orphans;
  for (const auto& [uuid, entry] : known) {
    if (!states.has_writer(entry.writer)) orphans.push_back(uuid);
  }
  if (orphans.size() == known.size()) return;  // no run that goes on
  for (const auto& uuid : orphans) {
    if (!may_still_come(known.at(uuid).object.lineage)) gone(uuid, Gone::kReplaced);
  }
}

void ObjectWatch::Impl::gone(const std::array<std::uint8_t, 16>& uuid, Gone why) {
  const auto entry = known.find(uuid);
  if (entry == known.end()) return;
  WatchedObject last = std::move(entry->second.object);
  known.erase(entry);
  if (!options.on_gone) return;
  callbacks.call([this, last = std::move(last), why] { options.on_gone(last, why); });
}

void ObjectWatch::Impl::take_events() {
  events.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (!meta.valid || !options.on_event || message.map_id() != options.map_id) return;
    callbacks.call([this, event = dds::event_from(message), name = message.class_name()] {
      options.on_event(event, name);
    });
  });
}

void ObjectWatch::Impl::take_manifests() {
  bool heard = false;
  manifests.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (!meta.valid || message.map_id() != options.map_id) return;
    heard = true;
    const std::lock_guard<std::mutex> lock(mutex);
    for (auto writer = publishers.begin(); writer != publishers.end();) {
      writer = manifests.has_writer(writer->first) ? std::next(writer) : publishers.erase(writer);
    }
    if (message.final_version()) {
      publishers.erase(meta.writer);
    } else {
      publishers[meta.writer] = {message.epoch(), message.lineage(), message.object_count()};
    }
  });
  if (heard) forget_replaced();
}

ObjectWatch::ObjectWatch(const ObjectWatchOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}
ObjectWatch::~ObjectWatch() = default;

bool ObjectWatch::publisher_present() const {
  if (impl_->participant->hangs()) return false;
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return std::any_of(impl_->publishers.begin(), impl_->publishers.end(),
                     [&](const auto& entry) { return impl_->manifests.has_writer(entry.first); });
}

WatchStatus ObjectWatch::status() const {
  WatchStatus status;
  {
    const std::lock_guard<std::mutex> lock(impl_->mutex);
    status = impl_->counts;
  }
  if (impl_->participant->hangs()) status.hangs = "Fast DDS's discovery hangs";
  status.callbacks = impl_->callbacks.status();
  status.failures = impl_->thread.failures();
  status.last_failure = impl_->thread.last_failure();
  return status;
}

}  // namespace pocd
