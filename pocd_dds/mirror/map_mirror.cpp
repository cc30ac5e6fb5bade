#include "pocd_dds/map_mirror.hpp"

#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <random>
#include <tuple>

#include "mirror/callback_thread.hpp"
#include "mirror/catch_up.hpp"
#include "mirror/look_copy.hpp"
#include "mirror/mirror_bus.hpp"
#include "mirror/object_copy.hpp"
#include "mirror/part_assembler.hpp"
#include "mirror/publishers.hpp"
#include "mirror/reading_thread.hpp"
#include "mirror/rejoin_plan.hpp"
#include "mirror/shared_participant.hpp"
#include "pocd/map/map_follower.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/bridge/map_messages.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd {
namespace {

using Clock = std::chrono::steady_clock;
namespace msg = pocd_msgs::msg;

constexpr std::chrono::milliseconds kIdle{50};
/// Longer than Fast DDS takes for any message [s]: discovery may hang, and whoever makes or deletes
/// an endpoint then hangs, too.
constexpr double kReturns = 1.0;
constexpr int kMost = 1000;  // samples of a topic in one turn, so that no peer holds up the others

std::array<std::uint8_t, 16> random_id() {
  std::random_device device;
  std::array<std::uint8_t, 16> id{};
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(device());
  return id;
}

std::string conflict(std::uint32_t map_id, std::uint64_t followed,
                     const std::vector<std::uint64_t>& rivals) {
  char text[160];
  std::snprintf(text, sizeof text,
                "map %u is published by %zu nodes at once, epochs %016llx (followed) and %016llx: "
                "give each a node.map_id of its own",
                map_id, rivals.size() + 1, static_cast<unsigned long long>(followed),
                static_cast<unsigned long long>(rivals.front()));
  return text;
}

}  // namespace

struct MapMirror::Impl {
  explicit Impl(const MirrorOptions& given)
      : options(given),
        id(random_id()),
        bus(join(nullptr)),
        plan(given.catch_up),
        objects(given.map_id),
        looks(given.map_id),
        callbacks(given.callbacks, [this](const std::string& text) { tell(text); }),
        thread([this] { turn(); }, [this](const std::string& text) { tell(text); }) {}

  ~Impl() {
    callbacks.stop_waiting();
    thread.stop([this] { wakeup.wake(); });
  }

  void tell(const std::string& text) const { dds::log_error("{}: {}", options.name, text); }
  /// With a participant that others may share, but not with this one.
  std::unique_ptr<dds::MirrorBus> join(const std::shared_ptr<dds::Participant>& instead_of);
  void turn();
  void join_anew_if_deaf();
  void stop_gathering();
  /// Of this map, and not of a publisher beside the one that is followed.
  template <class Message>
  bool ours(const Message& message) const {
    return message.map_id() == options.map_id && !publishers.foreign(message.epoch(), Clock::now());
  }
  void take_events();
  void take_manifests();
  void take_deltas();
  void take_replies();
  void take_tiles();
  /// What the publisher that is followed says of itself; null before it was heard.
  const msg::MapManifest* followed() const { return manifest ? &*manifest : nullptr; }
  void catch_up();
  void ask();
  MirrorStatus status_now() const;

  const MirrorOptions options;
  const std::array<std::uint8_t, 16> id;
  dds::Wakeup wakeup;
  /// Only the thread replaces it, under the mutex.
  std::unique_ptr<dds::MirrorBus> bus;
  dds::RejoinPlan rejoining;
  // While tiles are gathered; by the thread.
  std::map<std::array<std::uint8_t, 16>, std::uint64_t> epoch_of_writer;
  std::map<std::array<std::uint8_t, 16>, TileKey> tile_of_instance;
  dds::CatchUpPlan plan;

  // Guards everything up to the thread.
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  MapFollower follower;
  dds::Publishers publishers;
  std::optional<msg::MapManifest> manifest;
  dds::SampleMeta::Guid manifest_writer{};
  dds::ObjectCopy objects;
  dds::LookCopy looks;
  dds::PartAssembler<std::pair<std::uint64_t, std::uint64_t>, msg::MapDelta> delta_parts;
  dds::PartAssembler<std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>, msg::MapSnapshotReply>
      reply_parts;
  std::pair<std::uint64_t, std::uint64_t> last_at{0, 0};
  std::uint64_t asked = 0, damaged = 0;
  dds::ProblemCounter problems;

  dds::CallbackThread callbacks;
  dds::ReadingThread thread;
};

std::unique_ptr<dds::MirrorBus> MapMirror::Impl::join(
    const std::shared_ptr<dds::Participant>& instead_of) {
  return std::make_unique<dds::MirrorBus>(
      dds::shared_participant(
          {options.domain, options.profiles_file, options.name, options.security_folder},
          instead_of),
      options, wakeup);
}

void MapMirror::Impl::join_anew_if_deaf() {
  const auto now = Clock::now();
  const auto silence = publishers.silence(now);
  if (!rejoining.due(now, silence)) return;
  // The end of the old one would never return.
  if (bus->participant->still_s() > kReturns) return;
  dds::log_warning("{}: nothing was heard of the publisher for {} s: joins the bus anew",
                   options.name, std::chrono::duration_cast<std::chrono::seconds>(silence).count());
  // The new one before the old one goes, so that it gets other ports.
  std::unique_ptr<dds::MirrorBus> other = join(bus->participant);
  const std::lock_guard<std::mutex> lock(mutex);
  if (bus->tiles) stop_gathering();
  objects.begin_anew();
  bus.swap(other);
}

void MapMirror::Impl::stop_gathering() {
  bus->tiles.reset();
  follower.stop_gathering();
  epoch_of_writer.clear();
  tile_of_instance.clear();
}

void MapMirror::Impl::turn() {
  wakeup.wait_for(kIdle);
  join_anew_if_deaf();
  take_events();
  {
    const std::lock_guard<std::mutex> lock(mutex);
    objects.take(bus->object_states, kMost);
    if (bus->look_states) damaged += looks.take(*bus->look_states, kMost);
    take_deltas();
    take_replies();
    take_manifests();
    take_tiles();
    bus->count_damaged(problems);
    catch_up();
  }
  changed.notify_all();
}

void MapMirror::Impl::take_events() {
  bus->events.take_some(kMost, [&](const msg::ObjectEvent& message, const dds::SampleMeta& meta) {
    if (!meta.valid || !options.on_event || message.map_id() != options.map_id) return;
    callbacks.call([this, event = dds::event_from(message), name = message.class_name()] {
      options.on_event(event, name);
    });
  });
}

void MapMirror::Impl::take_manifests() {
  bus->manifests.take_some(kMost, [&](const msg::MapManifest& message,
                                      const dds::SampleMeta& meta) {
    if (!meta.valid || message.map_id() != options.map_id) return;
    if (!publishers.heard(meta.writer, message.epoch(), message.final_version(), Clock::now())) {
      return;
    }
    // A run has one writer as long as it lives.
    if (manifest && manifest->epoch() == message.epoch() && meta.writer != manifest_writer) {
      problems.count(bus->manifests.topic(), "epoch_reused",
                     "epoch " + std::to_string(message.epoch()) + " names two runs", 1);
      follower.forget();
    }
    manifest_writer = meta.writer;
    if (manifest && manifest->epoch() != message.epoch()) {
      const auto of_this_run = [&](const auto& key) { return std::get<0>(key) == message.epoch(); };
      delta_parts.keep(of_this_run);
      reply_parts.keep(of_this_run);
    }
    follower.published(message.epoch(), message.version(), dds::digest_from(message.digest()));
    manifest = message;
  });
  if (manifest) objects.settle(*manifest);
  publishers.forget_gone([&](const auto& writer) { return bus->manifests.has_writer(writer); },
                         Clock::now());
}

void MapMirror::Impl::take_deltas() {
  bus->deltas.take_some(kMost, [&](const msg::MapDelta& message, const dds::SampleMeta& meta) {
    if (!meta.valid || !ours(message)) return;
    if (follower.follows(message.epoch(), message.base_version())) plan.progress(Clock::now());
    const auto parts = delta_parts.add({message.epoch(), message.version()}, message);
    if (!parts) return;
    std::optional<MapDelta> delta = dds::delta_from(*parts);
    if (delta) {
      follower.delta(std::move(*delta));
    } else {
      ++damaged;
    }
  });
}

void MapMirror::Impl::take_replies() {
  if (!bus->replies) return;
  bus->replies->take_some(
      kMost, [&](const msg::MapSnapshotReply& message, const dds::SampleMeta& meta) {
        if (!meta.valid || !ours(message)) return;
        // Others ask, too: what this copy has no use for is not kept.
        if (!follower.needs(dds::snapshot_header(message))) return;
        plan.progress(Clock::now());
        const auto parts =
            reply_parts.add({message.epoch(), message.version(), message.base_version()}, message);
        if (!parts) return;
        std::optional<MapSnapshot> snapshot = dds::snapshot_from(*parts);
        if (snapshot) {
          follower.snapshot(std::move(*snapshot));
        } else {
          ++damaged;
        }
      });
}

void MapMirror::Impl::take_tiles() {
  if (!bus->tiles) return;
  bus->tiles->take_some(kMost, [&](const msg::MapTile& message, const dds::SampleMeta& meta) {
    // One that is new leads on; changes of known ones go on for ever.
    if (tile_of_instance.count(meta.key) == 0) plan.progress(Clock::now());
    if (meta.valid) {
      if (!ours(message)) return;
      epoch_of_writer[meta.writer] = message.epoch();
      tile_of_instance[meta.key] = {message.x(), message.y(), message.z()};
      std::optional<MapTile> tile = dds::tile_from(message);
      if (tile) {
        follower.tile(message.epoch(), std::move(*tile));
      } else {
        ++damaged;
      }
    } else if (meta.disposed) {
      const auto epoch = epoch_of_writer.find(meta.writer);
      const auto tile = tile_of_instance.find(meta.key);
      if (epoch == epoch_of_writer.end() || tile == tile_of_instance.end()) return;
      follower.tile_gone(epoch->second, tile->second);
    }
  });
}

void MapMirror::Impl::catch_up() {
  const std::pair<std::uint64_t, std::uint64_t> at{follower.replica().epoch().value_or(0),
                                                   follower.replica().version()};
  if (at != last_at) {
    plan.progress(Clock::now());
    // What lacks parts and leads no further is not waited for.
    const auto leads_on = [&](const auto& key) {
      return std::get<0>(key) != at.first || std::get<1>(key) > at.second;
    };
    delta_parts.keep(leads_on);
    reply_parts.keep(leads_on);
  }
  last_at = at;
  if (bus->participant->still_s() > kReturns) return;
  const bool stale = manifest && !follower.current() && publishers.present();
  const bool hears = bus->replies && bus->replies->matched() > 0;
  const auto wish = plan.next(Clock::now(), {stale, bus->requests.matched() > 0, hears});
  if (!wish.listen) bus->replies.reset();
  if (wish.listen && !bus->replies) {
    bus->replies = std::make_unique<dds::Reader<msg::MapSnapshotReplyPubSubType>>(
        bus->participant, dds::topics::kSnapshotReply, wakeup);
  }
  if (bus->tiles && (!wish.gather || wish.restart)) {
    stop_gathering();
  }
  if (wish.gather && !bus->tiles) {
    follower.start_gathering();
    bus->tiles = std::make_unique<dds::Reader<msg::MapTilePubSubType>>(
        bus->participant, dds::topics::kMapTiles, wakeup);
  }
  if (wish.ask) ask();
}

void MapMirror::Impl::ask() {
  msg::MapSnapshotRequest request;
  request.requester(id);
  request.map_id(options.map_id);
  const bool base = follower.has_base();
  request.epoch(base ? *follower.replica().epoch() : 0);
  request.version(base ? follower.replica().version() : 0);
  bus->requests.write(request);
  ++asked;
}

MirrorStatus MapMirror::Impl::status_now() const {
  MirrorStatus status;
  const MapReplica& replica = follower.replica();
  const FollowerCounts& counts = follower.counts();
  status.deltas = counts.deltas;
  status.gaps = counts.gaps;
  status.corrupt = counts.corrupt + damaged + problems.total();
  status.snapshots_asked = asked;
  status.snapshots_taken = counts.snapshots;
  status.gathered = counts.gathered;
  status.epoch = manifest ? manifest->epoch() : 0;
  status.version = replica.version();
  status.digest = replica.digest();
  status.tiles = replica.tiles().size();
  status.objects = objects.count(followed());
  status.publisher_present = publishers.present();
  status.publisher_seen = publishers.followed().has_value();
  const auto now = Clock::now();
  const std::vector<std::uint64_t> rivals = publishers.rivals(now);
  status.publishers = rivals.size() + status.publisher_present;
  const bool ended =
      manifest && manifest->final_version() && manifest->version() == replica.version();
  status.callbacks = callbacks.status();
  status.failures = thread.failures();
  status.last_failure = thread.last_failure();
  status.stale_because = follower.stale_because();
  if (!manifest && !bus->manifests.misread_from().empty()) {
    status.stale_because =
        std::string(bus->manifests.topic()) + ": " + bus->manifests.misread_from();
  }
  if (status.stale_because.empty() && !ended && !status.publisher_present) {
    status.stale_because = "the publisher has gone without ending its run";
  }
  if (status.stale_because.empty() && publishers.silence(now) >= dds::Publishers::kQuiet) {
    status.stale_because = "nothing was heard of the publisher for " +
                           std::to_string(dds::Publishers::kQuiet.count()) + " s";
  }
  if (bus->participant->hangs()) {
    status.stale_because = "Fast DDS's discovery hangs: start this process anew";
  }
  if (!rivals.empty()) status.stale_because = conflict(options.map_id, status.epoch, rivals);
  status.in_step = status.stale_because.empty();
  status.final_version = ended && status.in_step;
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
  contents.tiles = impl_->follower.replica().tiles();
  if (impl_->manifest) {
    contents.voxel_size_m = impl_->manifest->voxel_size();
    contents.truncation_m = impl_->manifest->truncation();
    contents.frame_id = impl_->manifest->frame_id();
  }
  impl_->objects.add_to(contents, impl_->followed());
  impl_->looks.add_to(contents, impl_->followed());
  return contents;
}

bool MapMirror::wait_until(const std::function<bool(const MirrorStatus&)>& condition,
                           std::chrono::milliseconds time) const {
  std::unique_lock<std::mutex> lock(impl_->mutex);
  return impl_->changed.wait_for(lock, time, [&] { return condition(impl_->status_now()); });
}

}  // namespace pocd
