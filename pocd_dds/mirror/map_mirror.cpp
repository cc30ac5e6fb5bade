#include "pocd_dds/map_mirror.hpp"

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <random>
#include <thread>
#include <tuple>

#include "mirror/part_assembler.hpp"
#include "pocd/map/map_replica.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd {
namespace {

using Clock = std::chrono::steady_clock;
namespace msg = pocd_msgs::msg;

// Deltas and manifest travel on different topics: what is behind for less than this is on its way.
constexpr std::chrono::milliseconds kPatience{300};
constexpr std::chrono::milliseconds kAskAgain{2000};
constexpr std::chrono::milliseconds kIdle{50};
// Deltas that came before what they build on; a snapshot asked for meanwhile needs the later ones.
constexpr std::size_t kRecentDeltas = 200;

std::array<std::uint8_t, 16> random_id() {
  std::random_device device;
  std::array<std::uint8_t, 16> id{};
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(device());
  return id;
}

}  // namespace

struct MapMirror::Impl {
  explicit Impl(const MirrorOptions& given)
      : options(given),
        id(random_id()),
        participant(std::make_shared<dds::Participant>(
            dds::BusOptions{given.domain, given.profiles_file, given.name})),
        manifests(participant, dds::topics::kMapManifest, wakeup),
        deltas(participant, dds::topics::kMapDeltas, wakeup),
        replies(participant, dds::topics::kSnapshotReply, wakeup),
        object_states(participant, dds::topics::kObjects, wakeup),
        events(participant, dds::topics::kObjectEvents, wakeup),
        requests(participant, dds::topics::kSnapshotRequest),
        thread([this] { run(); }) {}

  ~Impl() {
    stopping = true;
    wakeup.wake();
    thread.join();
  }

  void run();
  void take_objects();
  void take_events();
  void take_manifests();
  void take_deltas();
  void take_replies();
  void apply_recent();
  void ask_if_stale();
  MirrorStatus status_now() const;

  const MirrorOptions options;
  const std::array<std::uint8_t, 16> id;
  dds::Wakeup wakeup;
  std::shared_ptr<dds::Participant> participant;
  dds::Reader<msg::MapManifestPubSubType> manifests;
  dds::Reader<msg::MapDeltaPubSubType> deltas;
  dds::Reader<msg::MapSnapshotReplyPubSubType> replies;
  dds::Reader<msg::ObjectStatePubSubType> object_states;
  dds::Reader<msg::ObjectEventPubSubType> events;
  dds::Writer<msg::MapSnapshotRequestPubSubType> requests;

  // Guards everything up to the thread.
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  MapReplica replica;
  std::optional<msg::MapManifest> manifest;
  std::map<std::array<std::uint8_t, 16>, msg::ObjectState> objects;
  std::deque<MapDelta> recent;
  dds::PartAssembler<std::pair<std::uint64_t, std::uint64_t>, msg::MapDelta> delta_parts;
  dds::PartAssembler<std::uint32_t, msg::MapSnapshotReply> reply_parts;
  MirrorStatus counts;
  std::uint32_t last_request = 0;
  std::optional<Clock::time_point> stale_since, asked_at;

  std::atomic<bool> stopping{false};
  std::thread thread;
};

void MapMirror::Impl::run() {
  while (!stopping) {
    wakeup.wait_for(kIdle);
    take_events();
    {
      const std::lock_guard<std::mutex> lock(mutex);
      take_objects();
      take_deltas();
      take_replies();
      take_manifests();
      apply_recent();
      ask_if_stale();
    }
    changed.notify_all();
  }
}

void MapMirror::Impl::take_objects() {
  msg::ObjectState state;
  dds::SampleMeta meta;
  while (object_states.take(state, meta)) {
    if (meta.valid) {
      objects[state.uuid()] = state;
    } else if (meta.disposed) {
      objects.erase(meta.key);
    }
  }
}

void MapMirror::Impl::take_events() {
  msg::ObjectEvent message;
  dds::SampleMeta meta;
  while (events.take(message, meta)) {
    if (meta.valid && options.on_event) {
      options.on_event(dds::event_from(message), message.class_name());
    }
  }
}

void MapMirror::Impl::take_manifests() {
  msg::MapManifest message;
  dds::SampleMeta meta;
  while (manifests.take(message, meta)) {
    if (!meta.valid || message.map_id() != options.map_id) continue;
    if (!manifest || manifest->epoch() != message.epoch()) recent.clear();
    replica.note_published(message.epoch(), message.version(),
                           dds::digest_from(message.digest()));
    manifest = message;
  }
}

void MapMirror::Impl::take_deltas() {
  msg::MapDelta message;
  dds::SampleMeta meta;
  while (deltas.take(message, meta)) {
    if (!meta.valid || message.map_id() != options.map_id) continue;
    const auto parts = delta_parts.add({message.epoch(), message.version()}, message);
    if (!parts) continue;
    std::optional<MapDelta> delta = dds::delta_from(*parts);
    if (!delta) {
      ++counts.corrupt;
      continue;
    }
    ++counts.deltas;
    recent.push_back(std::move(*delta));
    if (recent.size() > kRecentDeltas) recent.pop_front();
    apply_recent();
  }
}

void MapMirror::Impl::apply_recent() {
  bool progress = true;
  while (progress) {
    progress = false;
    for (auto delta = recent.begin(); delta != recent.end();) {
      const DeltaOutcome outcome = replica.apply(*delta);
      if (outcome == DeltaOutcome::kGap || outcome == DeltaOutcome::kWrongEpoch) {
        ++delta;
        continue;
      }
      counts.corrupt += outcome == DeltaOutcome::kCorrupt;
      progress = progress || outcome == DeltaOutcome::kApplied;
      delta = recent.erase(delta);
    }
  }
}

void MapMirror::Impl::take_replies() {
  msg::MapSnapshotReply message;
  dds::SampleMeta meta;
  while (replies.take(message, meta)) {
    if (!meta.valid || message.requester() != id || message.request() != last_request) continue;
    const auto parts = reply_parts.add(message.request(), message);
    if (!parts) continue;
    // Tiles that the reply does not repeat are those of the copy, if it is of the same run.
    std::map<TileKey, MapTile> tiles;
    bool complete = true;
    for (const auto& part : *parts) {
      for (const auto& data : part.changed()) {
        std::optional<MapTile> tile = dds::tile_from(data);
        complete = complete && tile;
        if (tile) tiles[tile->key] = std::move(*tile);
      }
    }
    const bool same_run = replica.epoch() == message.epoch();
    for (const auto& part : *parts) {
      for (const auto& present : part.present()) {
        const TileKey key = dds::key_from(present);
        if (tiles.count(key) > 0) continue;
        const auto held = replica.tiles().find(key);
        complete = complete && same_run && held != replica.tiles().end();
        if (same_run && held != replica.tiles().end()) tiles.insert(*held);
      }
    }
    std::vector<MapTile> list;
    for (auto& [key, tile] : tiles) list.push_back(std::move(tile));
    if (complete && replica.replace(message.epoch(), message.version(),
                                    dds::digest_from(message.digest()), std::move(list))) {
      ++counts.snapshots_taken;
      asked_at.reset();
    } else {
      ++counts.corrupt;
    }
    apply_recent();
  }
}

void MapMirror::Impl::ask_if_stale() {
  const auto now = Clock::now();
  const bool stale = manifest && !status_now().in_step;
  if (!stale) {
    stale_since.reset();
    return;
  }
  if (!stale_since) stale_since = now;
  if (now - *stale_since < kPatience || requests.matched() == 0) return;
  if (asked_at && now - *asked_at < kAskAgain) return;
  asked_at = now;
  msg::MapSnapshotRequest request;
  request.requester(id);
  request.request(++last_request);
  request.map_id(options.map_id);
  // A copy that does not fit its own digest has nothing to build on.
  const bool usable = replica.epoch() && counts.corrupt == 0;
  request.epoch(usable ? *replica.epoch() : 0);
  request.version(usable ? replica.version() : 0);
  requests.write(request);
  ++counts.snapshots_asked;
}

MirrorStatus MapMirror::Impl::status_now() const {
  MirrorStatus status = counts;
  status.epoch = manifest ? manifest->epoch() : 0;
  status.version = replica.version();
  status.digest = replica.digest();
  status.tiles = replica.tiles().size();
  for (const auto& [key, object] : objects) {
    status.objects += !manifest || object.epoch() == manifest->epoch();
  }
  status.publisher_present = manifests.matched() > 0;
  status.publisher_seen = manifests.ever_matched() > 0;
  // An empty map of version 0 needs no delta: the copy is right from the start.
  const bool untouched = manifest && manifest->version() == 0 && !replica.epoch();
  if (!manifest) {
    status.stale_because = "no publisher heard of yet";
  } else if (!untouched) {
    status.stale_because = replica.stale_because();
  }
  status.in_step = status.stale_because.empty();
  status.final_version =
      manifest && manifest->final_version() && status.in_step &&
      (untouched || manifest->version() == replica.version());
  return status;
}

MapMirror::MapMirror(const MirrorOptions& options) : impl_(std::make_unique<Impl>(options)) {}
MapMirror::~MapMirror() = default;

MirrorStatus MapMirror::status() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->status_now();
}

MirrorContents MapMirror::contents() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  MirrorContents contents;
  contents.status = impl_->status_now();
  contents.tiles = impl_->replica.tiles();
  if (impl_->manifest) {
    contents.voxel_size_m = impl_->manifest->voxel_size();
    contents.truncation_m = impl_->manifest->truncation();
    contents.frame_id = impl_->manifest->frame_id();
  }
  for (const auto& [key, state] : impl_->objects) {
    if (impl_->manifest && state.epoch() != impl_->manifest->epoch()) continue;
    contents.objects.push_back(dds::object_from(state));
    contents.class_names[state.class_id()] = state.class_name();
  }
  return contents;
}

bool MapMirror::wait_until(const std::function<bool(const MirrorStatus&)>& condition,
                           std::chrono::milliseconds time) const {
  std::unique_lock<std::mutex> lock(impl_->mutex);
  return impl_->changed.wait_for(lock, time, [&] { return condition(impl_->status_now()); });
}

}  // namespace pocd
