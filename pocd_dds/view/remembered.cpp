#include "view/remembered.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "view/surface_maker.hpp"

namespace pocd::view {
namespace {

constexpr std::size_t kEventsAtOnce = 1000;
constexpr std::size_t kTilesAtOnce = 1024;

/// Objects as the log has them, from one event to the next.
class Standing {
 public:
  Standing(MemoryReader& reader, ObjectFeed& objects)
      : lineage_(reader.lineage()), names_(reader.class_names()), objects_(objects) {
    for (const LoggedRun& run : reader.runs()) {
      // A run that was not on a bus has no epoch: its number is one in this file.
      epochs_[run.run] = run.epoch != 0 ? run.epoch : static_cast<std::uint64_t>(run.run);
      last_epoch_ = epochs_[run.run];
    }
    objects_.know_run(last_epoch_, lineage_);
  }

  void take(const LoggedEvent& logged, bool tell) {
    const ObjectEvent& event = logged.event;
    if (tell) {
      ClassMap names;
      const std::uint64_t epoch = epochs_.count(logged.run) > 0 ? epochs_[logged.run] : lineage_;
      auto message = dds::event_message(event, {0, epoch, lineage_}, names, "");
      message.class_name(name_of(event.class_id));
      objects_.logged(message);
    }
    if (event.object == ObjectId::kNone) return;
    if (event.absorbed) there_.erase(*event.absorbed);
    if (event.kind == EventKind::kRemoved || event.kind == EventKind::kOperator) {
      there_.erase(event.object);
      return;
    }
    WatchedObject& object = there_[event.object];
    if (object.state.first_seen_ns == 0) object.state.first_seen_ns = event.stamp_ns;
    object.uuid = dds::object_uuid(lineage_, event.object);
    object.epoch = last_epoch_;
    object.lineage = lineage_;
    object.class_name = name_of(event.class_id);
    object.state.id = event.object;
    object.state.class_id = event.class_id;
    object.state.stationarity_class = event.evidence.stationarity_class;
    object.state.box = event.box;
    object.state.belief = event.evidence.after;
    object.state.last_seen_ns = event.stamp_ns;
    object.state.last_robot = event.robot;
  }
  void tell() {
    for (const auto& entry : there_) objects_.object(entry.second);
  }
  std::size_t size() const { return there_.size(); }
  std::uint64_t last_epoch() const { return last_epoch_; }

 private:
  std::string name_of(ClassId id) const {
    const auto name = names_.find(id);
    return name == names_.end() ? "class_" + std::to_string(id) : name->second;
  }

  std::uint64_t lineage_, last_epoch_ = 0;
  std::map<ClassId, std::string> names_;
  std::map<std::int64_t, std::uint64_t> epochs_;
  std::map<ObjectId, WatchedObject> there_;
  ObjectFeed& objects_;
};

}  // namespace

Remembered::Remembered(const std::filesystem::path& folder, Board& board)
    : name_(folder.filename().empty() ? folder.parent_path().filename().string()
                                      : folder.filename().string()),
      board_(board),
      objects_(board),
      reader_(folder),
      info_(reader_.info()) {
  read_log();
  say_status(0.0);
  thread_ = std::thread([this] {
    try {
      draw();
    } catch (const std::exception& error) {
      damage_.push_back(error.what());
      spdlog::error("{}", error.what());
    }
    say_status(1.0);
  });
}

Remembered::~Remembered() {
  stopping_ = true;
  thread_.join();
}

void Remembered::read_log() {
  Standing standing(reader_, objects_);
  for (const LoggedEvent& logged : reader_.standing()) standing.take(logged, false);
  std::uint64_t told_from = 0;
  if (info_.last_event > ObjectFeed::kMostEvents) {
    told_from = info_.last_event - ObjectFeed::kMostEvents;
  }
  for (std::uint64_t after = 0;;) {
    const auto events = reader_.events(after, kEventsAtOnce);
    if (events.empty()) break;
    for (const LoggedEvent& logged : events) {
      standing.take(logged, logged.event.sequence > told_from);
    }
    after = events.back().event.sequence;
  }
  standing.tell();
  epoch_ = standing.last_epoch();
  standing_ = standing.size();
  if (reader_.damaged_events() > 0) {
    damage_.push_back(std::to_string(reader_.damaged_events()) + " events are damaged");
  }
}

void Remembered::draw() {
  std::map<TileKey, MapTile> tiles;
  for (MapTile& tile : reader_.tiles(damage_)) tiles[tile.key] = std::move(tile);
  const double all = static_cast<double>(std::max<std::size_t>(tiles.size(), 1));
  SurfaceMaker maker;
  maker.update(std::move(tiles), objects_.run_of(epoch_), info_.voxel_size_m,
               info_.truncation_voxels * info_.voxel_size_m);
  while (!maker.idle() && !stopping_) {
    board_.put_surfaces(maker.make(kTilesAtOnce), info_.stamp_ns);
    say_status(std::min(0.99, static_cast<double>(maker.drawn()) / all));
  }
  if (maker.unreadable() > 0) {
    damage_.push_back(std::to_string(maker.unreadable()) + " tiles are damaged");
  }
}

void Remembered::say_status(double read) {
  Json json = played_json("memory", name_, read, damage_.empty() ? "" : damage_.front());
  json["run"] = objects_.run_of(epoch_);
  json["epoch"] = hex(epoch_);
  json["version"] = info_.map_version;
  json["tiles"] = info_.tiles;
  json["objects"] = standing_;
  json["voxel"] = info_.voxel_size_m;
  if (const auto range = objects_.time_range()) {
    json["time"] = {range->first, std::max(range->second, seconds(info_.stamp_ns))};
  }
  board_.put_notice("status", text_of(json));
}

}  // namespace pocd::view
