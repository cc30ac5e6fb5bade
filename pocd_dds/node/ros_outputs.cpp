#include "pocd_dds/node/ros_outputs.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string_view>

#include "pocd/map/birdseye.hpp"
#include "pocd_dds/bridge/map_messages.hpp"

namespace pocd::dds {
namespace {

std::string source_of(std::uint64_t epoch) {
  char text[32];
  std::snprintf(text, sizeof text, "pocd-%016llx", static_cast<unsigned long long>(epoch));
  return text;
}

OccupancyOptions occupancy_options(const NodeFile& config) {
  const GridExtentConfig& extent = config.node.outputs.occupancy_extent;
  const double cell_m = config.pipeline.map.voxel_size_m;
  OccupancyOptions options{cell_m,
                           config.pipeline.map.truncation_m(),
                           config.node.outputs.occupancy_low_m,
                           config.node.outputs.occupancy_high_m,
                           config.node.outputs.occupancy_not_looked_at,
                           {}};
  if (extent.given()) {
    options.extent =
        cells_around(extent.min_x_m, extent.min_y_m, extent.max_x_m, extent.max_y_m, cell_m);
  }
  return options;
}

/// The keys of a list of steps, changed ones and removed ones.
struct Keys {
  std::vector<TileKey> changed, removed;
};
Keys split(std::map<TileKey, bool>& steps) {
  Keys keys;
  for (const auto& [key, changed] : steps) (changed ? keys.changed : keys.removed).push_back(key);
  steps.clear();
  return keys;
}

}  // namespace

RosOutputs::RosOutputs(const std::shared_ptr<Participant>& participant, const NodeFile& config,
                       std::uint64_t epoch)
    : config_(config),
      rates_(config_.node.outputs),
      obstacle_options_{source_of(epoch), rates_.level_name, rates_.obstacle_lifetime_s},
      budget_(1e6 * rates_.rate_mb_s),
      markers_pace_(rates_.markers_hz),
      occupancy_pace_(rates_.occupancy_hz),
      surface_pace_(rates_.surface_hz),
      obstacles_pace_(rates_.obstacles_hz),
      projection_(occupancy_options(config)),
      points_(config.pipeline.map.voxel_size_m, config.pipeline.map.truncation_m()) {
  const auto make = [&](auto& writer, const Pace& pace, const TopicSpec& spec) {
    using AnyWriter = typename std::decay_t<decltype(writer)>::element_type;
    if (pace.off()) return;
    writer = std::make_unique<AnyWriter>(
        participant, spec, topics::in_namespace(spec, rates_.topic_namespace), spec.delivery);
  };
  make(markers_, markers_pace_, topics::kMarkers);
  make(grid_, occupancy_pace_, topics::kOccupancy);
  make(grid_updates_, occupancy_pace_, topics::kOccupancyUpdates);
  make(surface_, surface_pace_, topics::kSurface);
  if (rates_.ros_release != RosRelease::kHumble) {
    make(obstacles_, obstacles_pace_, topics::kRmfObstacles);
  } else if (!obstacles_pace_.off()) {
    humble_obstacles_ = std::make_unique<decltype(humble_obstacles_)::element_type>(
        participant, topics::kRmfObstacles, topics::kRmfObstacles.name);
  }
}

void RosOutputs::copy_tiles(const Changes<TileKey, MapTile>& tiles,
                            const std::set<BlockKey>& not_looked) {
  const auto note = [&](const TileKey& key, bool present) {
    if (grid_) grid_steps_[key] = present;
    if (surface_) surface_steps_[key] = present;
  };
  for (const TileKey& key : tiles.keys) {
    const auto tile = tiles.all.find(key);
    old_tiles_.erase(key);
    if (tile != tiles.all.end()) {
      if (grid_ && not_looked.count(region_of(key)) > 0) old_tiles_.insert(key);
      tiles_[key] = tile->second;
      note(key, true);
    } else if (tiles_.erase(key) > 0) {
      note(key, false);
    }
  }
  tiles.keys.clear();
}

void RosOutputs::collect(const Changes<ObjectId, ObjectSnapshot>& objects,
                         const Changes<TileKey, MapTile>& tiles, StampNs stamp_ns, StampNs now_ns,
                         bool last, const std::set<BlockKey>& not_looked) {
  // A topic without any reader is not worked for; who comes later gets it at the next period.
  markers_due_ = markers_ && (markers_pace_.due(now_ns) || last);
  const bool room = budget_.open(std::chrono::steady_clock::now());
  occupancy_due_ = grid_ && ((room && occupancy_pace_.due(now_ns)) || last);
  surface_due_ =
      surface_ && surface_->matched() > 0 && ((room && surface_pace_.due(now_ns)) || last);
  const bool obstacles = obstacles_ || humble_obstacles_;
  obstacles_due_ = obstacles && obstacles_pace_.due(now_ns) && !last;
  stamp_ns_ = stamp_ns;
  now_ns_ = now_ns;
  last_ = last;
  if (markers_due_ || obstacles_due_ || surface_due_) {
    for (const ObjectId id : objects.keys) {
      const auto object = objects.all.find(id);
      if (object != objects.all.end()) {
        objects_[id] = object->second;
      } else {
        objects_.erase(id);
      }
    }
    objects.keys.clear();
  }
  if (occupancy_due_ || surface_due_) copy_tiles(tiles, not_looked);
  // What no output needs must not grow for ever.
  if (!markers_ && !obstacles && !surface_) objects.keys.clear();
  if (!grid_ && !surface_) tiles.keys.clear();
}

bool RosOutputs::attempt(const std::string& topic, void (RosOutputs::*send_one)()) {
  std::string why;
  try {
    (this->*send_one)();
    return true;
  } catch (const std::exception& error) {
    why = error.what();
  } catch (...) {
    why = "unknown exception";
  }
  const std::lock_guard<std::mutex> lock(broken_mutex_);
  if (broken_[topic]++ == 0) {
    spdlog::error("{}: could not be made: {} (logged once, counted)", topic, why);
  }
  return false;
}

void RosOutputs::spend(const RawWriter& writer, std::size_t bytes) {
  budget_.spend(bytes * static_cast<std::size_t>(std::max(writer.matched(), 0)));
}

void RosOutputs::send() {
  // After a failure the next one says all that there is.
  if (markers_due_ && !attempt(markers_->topic(), &RosOutputs::send_markers))
    all_markers_anew_ = true;
  if (obstacles_due_) attempt(topics::kRmfObstacles.name, &RosOutputs::send_obstacles);
  if (occupancy_due_ && !attempt(grid_->topic(), &RosOutputs::send_occupancy)) grid_unsent_ = true;
  if (surface_due_ && !attempt(surface_->topic(), &RosOutputs::send_surface))
    surface_unsent_ = true;
  markers_due_ = obstacles_due_ = occupancy_due_ = surface_due_ = false;
}

bool RosOutputs::wait_acknowledged(std::chrono::steady_clock::time_point end) {
  const auto acknowledged = [end](const auto& writer) {
    return !writer || writer->wait_acknowledged(end);
  };
  return acknowledged(markers_) && acknowledged(grid_) && acknowledged(grid_updates_) &&
         acknowledged(surface_);
}

std::uint64_t RosOutputs::failures() const {
  const auto of = [](const auto& writer) { return writer ? writer->failures() : 0; };
  return of(markers_) + of(grid_) + of(grid_updates_) + of(surface_) + of(obstacles_) +
         of(humble_obstacles_);
}

void RosOutputs::send_markers() {
  auto message = marker_array(objects_, marker_departures_.update(objects_), all_markers_anew_,
                              stamp_ns_, config_.node.map_frame);
  all_markers_anew_ = !markers_->write(message);  // with one that is refused, deletions are, too
}

void RosOutputs::send_obstacles() {
  auto message = obstacles_message(objects_, config_.pipeline.classes, obstacle_options_, now_ns_,
                                   config_.node.map_frame);
  if (message.obstacles().empty()) return;
  if (obstacles_) {
    obstacles_->write(message);
    return;
  }
  rmf_obstacle_msgs::msg::ObstaclesHumble list;
  list.obstacles(std::move(message.obstacles()));
  humble_obstacles_->write(list);
}

void RosOutputs::send_occupancy() {
  const Keys keys = split(grid_steps_);
  std::vector<MapTile> changed;
  for (const TileKey& key : keys.changed) changed.push_back(tiles_.at(key));
  projection_.apply(changed, keys.removed, old_tiles_);
  const bool was_too_large = projection_.too_large();
  const bool resized = projection_.update();
  grid_too_large_ = projection_.too_large();
  if (projection_.too_large()) {
    if (!was_too_large) {
      spdlog::warn("{}: a grid of more than {} cells is not published", grid_->topic(),
                   OccupancyProjection::kMostCells);
    }
    return;
  }
  if (projection_.cut() && !grid_cut_.exchange(true)) {
    spdlog::warn("{}: part of the map lies outside of node.outputs.occupancy_extent",
                 grid_->topic());
  }
  // Who joins has the last whole grid, but not the updates since then: a new reader of either topic
  // makes it whole again, and so does the end.
  const int readers = grid_->ever_matched() + grid_updates_->ever_matched();
  const auto& rectangle = projection_.changed_rectangle();
  if (rectangle) grid_outdated_ = true;
  // Nav2 may lose an update that comes between a whole grid and its next cycle.
  const bool due = now_ns_ - grid_whole_ns_ >= static_cast<StampNs>(1e9 * rates_.occupancy_whole_s);
  // One that is refused is made good by a whole one at the next period.
  if (resized || grid_unsent_ || (grid_outdated_ && (readers != grid_readers_ || due || last_))) {
    grid_whole_ns_ = now_ns_;
    auto message = grid_message(projection_.grid(), config_.pipeline.map.voxel_size_m, stamp_ns_,
                                config_.node.map_frame);
    spend(*grid_, message.data().size());
    grid_outdated_ = grid_unsent_ = !grid_->write(message);
  } else if (rectangle) {
    auto message = grid_update_message(*rectangle, stamp_ns_, config_.node.map_frame);
    spend(*grid_updates_, message.data().size());
    grid_unsent_ = !grid_updates_->write(message);
  }
  grid_readers_ = readers;
}

void RosOutputs::send_surface() {
  const Keys keys = split(surface_steps_);
  if (keys.changed.empty() && keys.removed.empty() && !surface_unsent_) return;
  points_.apply(tiles_, keys.changed, keys.removed);
  std::vector<ObjectSnapshot> objects;
  for (const auto& [id, object] : objects_) objects.push_back(object);
  auto message = cloud_message(points_, appearance_by_stationarity(objects),
                               static_cast<std::size_t>(rates_.surface_points), stamp_ns_,
                               config_.node.map_frame);
  spend(*surface_, message.data().size());
  surface_unsent_ = !surface_->write(message);
}

}  // namespace pocd::dds
