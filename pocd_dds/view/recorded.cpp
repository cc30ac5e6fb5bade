#include "view/recorded.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>

#include "mirror/part_assembler.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_follower.hpp"
#include "pocd/recording/recording_files.hpp"
#include "pocd_dds/bridge/look_messages.hpp"
#include "pocd_dds/bridge/map_messages.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/guarded_type.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"
#include "pocd_msgsPubSubTypes.h"
#include "view/looks.hpp"
#include "view/object_feed.hpp"
#include "view/surface_maker.hpp"

namespace pocd::view {
namespace {

namespace msg = pocd_msgs::msg;
using recording::RecordedMessage;

constexpr std::size_t kTilesAtOnce = 4096;
constexpr StampNs kStep_ns = 500000000;  // of the map's past
constexpr int kMostSteps = 500;          // of a recording, at most about
constexpr std::chrono::milliseconds kTellPeriod{500};

/// The message, or nothing for a payload that is none.
template <class PubSubType>
std::optional<typename PubSubType::type> decoded(const RecordedMessage& recorded) {
  eprosima::fastrtps::rtps::SerializedPayload_t payload;
  payload.data = const_cast<std::uint8_t*>(recorded.data);
  payload.length = payload.max_size = static_cast<std::uint32_t>(recorded.size);
  typename PubSubType::type message;
  const bool good =
      recorded.size >= 4 && dds::GuardedType<PubSubType>().deserialize(&payload, &message);
  payload.data = nullptr;  // not its own
  if (!good) return std::nullopt;
  return message;
}

}  // namespace

struct Recorded::Impl {
  using Handler = std::function<void(const RecordedMessage&)>;

  Impl(const RecordedOptions& given, Board& target)
      : options(given), board(target), objects(board), looks(board), files(given.inputs) {
    std::size_t of_a_map = 0;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const auto& reader = files.reader(i);
      for (const auto& channel : reader.channels()) of_a_map += holds_map(channel);
      bytes += reader.info().bytes;
      messages += reader.info().messages;
      start_ns = i == 0 ? reader.info().start_ns : std::min(start_ns, reader.info().start_ns);
      end_ns = std::max(end_ns, reader.info().end_ns);
    }
    if (of_a_map == 0) {
      throw InputError(
          files.path(0).string() +
          ": holds no map and no objects (topics pocd/map/deltas, pocd/objects): record "
          "with --topic 'pocd/*', or map it with pocd_map --memory FOLDER and open that");
    }
    follower.start_gathering();
    say_status();
    thread = std::thread([this] {
      try {
        read();
      } catch (const std::exception& error) {
        problem = error.what();
        spdlog::error("{}", problem);
      }
      finished = true;
      say_status();
    });
  }
  ~Impl() {
    stopping = true;
    thread.join();
  }

  static bool holds_map(const recording::RecordedChannel& channel) {
    const auto topic = dds::topic_of(channel);
    if (!topic || !dds::instances_of(channel).empty()) return false;
    return topic->name == dds::topics::kMapDeltas.name ||
           topic->name == dds::topics::kMapTiles.name ||
           topic->name == dds::topics::kObjects.name ||
           topic->name == dds::topics::kObjectEvents.name;
  }

  void read();
  Handler handler_of(const recording::RecordedChannel& channel);
  Handler robot_handler_of(const dds::RecordedTopic& topic);
  template <class PubSubType, class Use>
  Handler reading(const std::string& topic, Use use) {
    return [this, topic, use](const RecordedMessage& recorded) {
      const auto message = decoded<PubSubType>(recorded);
      if (!message) {
        if (unreadable++ == 0) spdlog::warn("{}: a message cannot be read", topic);
        return;
      }
      use(*message);
    };
  }
  void object(const msg::ObjectState& state);
  void object_gone(const std::array<std::uint8_t, 16>& uuid, Gone why);
  void manifest(const msg::MapManifest& message);
  void delta(const msg::MapDelta& message);
  void tile(const msg::MapTile& message);
  void looked(const msg::MapLooks& message);
  void map_has_changed();
  void draw();
  void say_status();

  const RecordedOptions options;
  Board& board;
  ObjectFeed objects;
  Looks looks;
  recording::RecordingFiles files;
  std::uint64_t bytes = 0, messages = 0, start_ns = 0, end_ns = 0;

  // Of the thread.
  MapFollower follower;
  SurfaceMaker maker;
  RobotPoses robots;
  dds::PartAssembler<std::pair<std::uint64_t, std::uint64_t>, msg::MapDelta> parts;
  std::map<std::array<std::uint8_t, 16>, WatchedObject> known;
  std::map<dds::SectorKey, std::map<BlockKey, dds::SectorLook>> sectors;
  std::optional<msg::MapManifest> last_manifest;
  std::optional<StampNs> drawn_ns;
  std::uint64_t drawn_version = 0, drawn_epoch = 0;
  std::uint64_t read_messages = 0, log_ns = 0;
  std::size_t not_looked_at = 0;

  std::atomic<std::uint64_t> unreadable{0};
  std::atomic<bool> finished{false}, stopping{false};
  std::string problem;
  std::thread thread;
};

Recorded::Impl::Handler Recorded::Impl::robot_handler_of(const dds::RecordedTopic& topic) {
  const auto name_of = [&](const std::string& pattern) -> std::optional<std::string> {
    return robot_in(pattern, topic.name);
  };
  if (const auto name = name_of(options.robots.odometry);
      name && topic.type == dds::topics::kOdometry.type) {
    robots.know(*name);
    return reading<nav_msgs::msg::OdometryPubSubType>(
        topic.name, [this, name = *name, topic = topic.name](const auto& message) {
          robots.odometry(name, message, topic);
        });
  }
  if (const auto name = name_of(options.robots.camera_info);
      name && topic.type == dds::topics::kCameraInfo.type) {
    robots.know(*name);
    return reading<sensor_msgs::msg::CameraInfoPubSubType>(
        topic.name, [this, name = *name, topic = topic.name](const auto& message) {
          robots.camera_info(name, message, topic);
        });
  }
  return nullptr;
}

Recorded::Impl::Handler Recorded::Impl::handler_of(const recording::RecordedChannel& channel) {
  using namespace dds::topics;  // NOLINT: a list of them
  const std::string instances = dds::instances_of(channel);
  if (!instances.empty()) {
    if (instances != kObjects.name) return nullptr;
    return [this](const RecordedMessage& recorded) {
      try {
        const auto [change, key] = dds::parse_instance(recorded.data, recorded.size);
        if (change == dds::InstanceChange::kDisposed) object_gone(key, Gone::kRemoved);
      } catch (const std::exception&) {
        ++unreadable;
      }
    };
  }
  const auto topic = dds::topic_of(channel);
  if (!topic) return nullptr;
  const std::string& name = topic->name;
  if (name == kObjects.name) {
    return reading<msg::ObjectStatePubSubType>(name, [this](const auto& m) { object(m); });
  }
  if (name == kObjectEvents.name) {
    return reading<msg::ObjectEventPubSubType>(name, [this](const auto& m) {
      if (m.map_id() == options.map_id) objects.event(m);
    });
  }
  if (name == kMapManifest.name) {
    return reading<msg::MapManifestPubSubType>(name, [this](const auto& m) { manifest(m); });
  }
  if (name == kMapDeltas.name) {
    return reading<msg::MapDeltaPubSubType>(name, [this](const auto& m) { delta(m); });
  }
  if (name == kMapTiles.name) {
    return reading<msg::MapTilePubSubType>(name, [this](const auto& m) { tile(m); });
  }
  if (name == kMapLooks.name) {
    return reading<msg::MapLooksPubSubType>(name, [this](const auto& m) { looked(m); });
  }
  if (name == kTf.name || name == kTfStatic.name) {
    return reading<tf2_msgs::msg::TFMessagePubSubType>(
        name, [this, name, fixed = name == kTfStatic.name](const auto& m) {
          robots.transforms(m, fixed, name);
        });
  }
  return robot_handler_of(*topic);
}

void Recorded::Impl::object(const msg::ObjectState& state) {
  if (state.map_id() != options.map_id) return;
  if (state.forgotten()) return object_gone(state.uuid(), Gone::kForgotten);
  WatchedObject object{state.uuid(), state.epoch(), state.lineage(), state.class_name(),
                       dds::object_from(state)};
  objects.object(object);
  known[state.uuid()] = std::move(object);
}

void Recorded::Impl::object_gone(const std::array<std::uint8_t, 16>& uuid, Gone why) {
  const auto found = known.find(uuid);
  if (found == known.end()) return;
  objects.gone(found->second, why);
  known.erase(found);
}

void Recorded::Impl::manifest(const msg::MapManifest& message) {
  if (message.map_id() != options.map_id) return;
  objects.know_run(message.epoch(), message.lineage());
  const auto names = dds::MapRun{options.map_id, message.epoch(), message.lineage()}.names();
  if (last_manifest && last_manifest->epoch() != message.epoch()) {
    std::vector<std::array<std::uint8_t, 16>> others;
    for (const auto& [uuid, object] : known) {
      const dds::MapRun run{options.map_id, object.epoch, object.lineage};
      if (run.names() != names) others.push_back(uuid);
    }
    for (const auto& uuid : others) object_gone(uuid, Gone::kReplaced);
    if (!follower.gathering()) follower.start_gathering();
  }
  last_manifest = message;
  follower.published(message.epoch(), message.version(), dds::digest_from(message.digest()));
  map_has_changed();
}

void Recorded::Impl::delta(const msg::MapDelta& message) {
  if (message.map_id() != options.map_id) return;
  const auto whole = parts.add({message.epoch(), message.version()}, message);
  if (!whole) return;
  std::optional<MapDelta> step = dds::delta_from(*whole);
  if (!step) {
    ++unreadable;
    return;
  }
  follower.delta(std::move(*step));
  map_has_changed();
}

void Recorded::Impl::tile(const msg::MapTile& message) {
  if (message.map_id() != options.map_id || !follower.gathering()) return;
  std::optional<MapTile> one = dds::tile_from(message);
  if (!one) {
    ++unreadable;
    return;
  }
  follower.tile(message.epoch(), std::move(*one));
  map_has_changed();
}

void Recorded::Impl::looked(const msg::MapLooks& message) {
  if (message.map_id() != options.map_id) return;
  const auto regions = dds::looks_from(message);
  if (!regions) {
    ++unreadable;
    return;
  }
  sectors[{message.x(), message.y(), message.z()}] = *regions;
}

void Recorded::Impl::map_has_changed() {
  const MapReplica& replica = follower.replica();
  if (!replica.epoch() || !last_manifest || replica.corrupt()) return;
  // Once it follows the steps, single tiles say nothing new.
  if (follower.gathering() && follower.current()) follower.stop_gathering();
  // Stamps are those of the data: log times may be of another clock.
  const auto range = objects.time_range();
  if (!range) return;
  const StampNs now_ns = stamp_from(range->second);
  const StampNs step =
      std::max<StampNs>(kStep_ns, static_cast<StampNs>((end_ns - start_ns) / kMostSteps));
  if (drawn_ns && now_ns - *drawn_ns < step) return;
  draw();
}

void Recorded::Impl::draw() {
  const MapReplica& replica = follower.replica();
  if (!replica.epoch() || !last_manifest || replica.corrupt()) return;
  if (replica.version() == drawn_version && *replica.epoch() == drawn_epoch) return;
  const std::uint32_t run = objects.run_of(*replica.epoch());
  if (run == 0) return;
  const auto range = objects.time_range();
  const StampNs now_ns = range ? stamp_from(range->second) : static_cast<StampNs>(log_ns);
  drawn_version = replica.version();
  drawn_epoch = *replica.epoch();
  maker.update(replica.tiles(), run, last_manifest->voxel_size(), last_manifest->truncation());
  while (!maker.idle() && !stopping) board.put_surfaces(maker.make(kTilesAtOnce), now_ns);
  board.map_known_from(now_ns);
  drawn_ns = now_ns;
}

void Recorded::Impl::read() {
  auto told = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < files.size() && !stopping; ++i) {
    auto& reader = files.reader(i);
    std::vector<Handler> handlers;
    reader.select([this](const recording::RecordedChannel& channel) {
      return static_cast<bool>(handler_of(channel));
    });
    reader.seek(0);
    RecordedMessage message;
    while (!stopping && reader.next(message)) {
      // A file that is read through may tell of channels later on.
      while (handlers.size() <= message.channel) {
        handlers.push_back(handler_of(reader.channels()[handlers.size()]));
      }
      log_ns = message.log_time_ns;
      ++read_messages;
      if (handlers[message.channel]) handlers[message.channel](message);
      for (const RobotPose& pose : robots.take(options.map_frame)) objects.robot(pose);
      if (std::chrono::steady_clock::now() - told > kTellPeriod) {
        told = std::chrono::steady_clock::now();
        say_status();
      }
    }
    for (const std::string& damage : reader.problems()) {
      if (problem.empty()) problem = damage;
      spdlog::warn("{}", damage);
    }
    if (i + 1 < files.size()) files.close(i);
  }
  draw();
  std::vector<MirrorRegion> regions;
  for (const auto& sector : sectors) {
    for (const auto& [region, look] : sector.second) {
      regions.push_back({region, look.stamp_ns, look.in_run});
    }
  }
  not_looked_at = looks.tell(regions);
}

void Recorded::Impl::say_status() {
  const MapReplica& replica = follower.replica();
  const double share =
      end_ns <= start_ns || log_ns < start_ns
          ? 0.0
          : static_cast<double>(log_ns - start_ns) / static_cast<double>(end_ns - start_ns);
  Json json = played_json("recording", files.path(0).filename().string(),
                          finished ? 1.0 : std::min(0.99, share), problem);
  json["run"] = objects.run_of(drawn_epoch);
  json["epoch"] = hex(drawn_epoch);
  json["version"] = replica.version();
  json["tiles"] = replica.tiles().size();
  json["objects"] = known.size();
  json["voxel"] = last_manifest ? last_manifest->voxel_size() : 0.0;
  json["drawn"] = maker.drawn();
  json["earlier_tiles"] = maker.earlier_tiles();
  json["regions_not_looked_at"] = not_looked_at;
  json["unknown_objects"] = objects.unknown();
  json["unreadable"] = unreadable.load();
  if (const auto range = objects.time_range()) json["time"] = {range->first, range->second};
  if (const auto since = board.map_known_since()) json["map_since"] = seconds(*since);
  board.put_notice("status", text_of(json));
}

Recorded::Recorded(const RecordedOptions& options, Board& board)
    : impl_(std::make_unique<Impl>(options, board)) {}
Recorded::~Recorded() = default;

std::optional<std::string> Recorded::history(const std::string& uuid) const {
  return impl_->objects.history(uuid);
}

std::string Recorded::then(double stamp_s) const {
  const StampNs stamp_ns = stamp_from(stamp_s);
  const auto since = impl_->board.map_known_since();
  return impl_->objects.then(stamp_ns, since && stamp_ns >= *since);
}

}  // namespace pocd::view
