#include "pocd_dds/node/visual_publication.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::dds {
namespace {

constexpr std::int32_t kCube = 1, kAdd = 0, kDelete = 2;          // visualization_msgs/Marker
constexpr std::int8_t kUnknown = -1, kFree = 0, kOccupied = 100;  // nav_msgs/OccupancyGrid
// A grid of more cells is no picture any more, and a mistaken far tile must not eat all memory.
constexpr std::int64_t kMostCells = 64'000'000;

visualization_msgs::msg::Marker marker_of(const ObjectSnapshot& object) {
  visualization_msgs::msg::Marker marker;
  marker.type(kCube);
  marker.action(kAdd);
  const OrientedBox& box = object.box;
  marker.pose().position().x(box.pose.position_W.x());
  marker.pose().position().y(box.pose.position_W.y());
  marker.pose().position().z(box.pose.position_W.z());
  marker.pose().orientation().z(std::sin(box.pose.yaw_rad / 2));
  marker.pose().orientation().w(std::cos(box.pose.yaw_rad / 2));
  marker.scale().x(box.size_m.x());
  marker.scale().y(box.size_m.y());
  marker.scale().z(box.size_m.z());
  const auto stationarity = static_cast<float>(object.belief.stationarity());
  marker.color().r(1.0f - stationarity);
  marker.color().g(stationarity);
  marker.color().b(0.2f);
  marker.color().a(0.6f);
  return marker;
}

}  // namespace

VisualPublication::VisualPublication(const std::shared_ptr<Participant>& participant,
                                     const NodeFile& config)
    : config_(config) {
  if (config.node.publish_markers) {
    markers_ = std::make_unique<Writer<visualization_msgs::msg::MarkerArrayPubSubType>>(
        participant, topics::kMarkers);
  }
  if (config.node.publish_occupancy) {
    grid_ = std::make_unique<Writer<nav_msgs::msg::OccupancyGridPubSubType>>(participant,
                                                                             topics::kOccupancy);
  }
}

void VisualPublication::send_markers(const std::map<ObjectId, ObjectSnapshot>& objects,
                                     StampNs stamp_ns) {
  if (!markers_) return;
  visualization_msgs::msg::MarkerArray array;
  const auto push = [&](visualization_msgs::msg::Marker marker, ObjectId id) {
    marker.header().stamp(to_time(stamp_ns));
    marker.header().frame_id(config_.node.map_frame);
    marker.ns("pocd");
    marker.id(static_cast<std::int32_t>(to_index(id)));
    array.markers().push_back(std::move(marker));
  };
  for (const ObjectId id : shown_) {
    if (objects.count(id) > 0) continue;
    visualization_msgs::msg::Marker gone;
    gone.action(kDelete);
    push(gone, id);
  }
  shown_.clear();
  for (const auto& [id, object] : objects) {
    push(marker_of(object), id);
    shown_.insert(id);
  }
  markers_->write(array);
}

void VisualPublication::send_occupancy(const std::map<TileKey, MapTile>& tiles, StampNs stamp_ns) {
  if (!grid_ || tiles.empty()) return;
  const TsdfConfig& map = config_.pipeline.map;
  const double voxel_m = map.voxel_size_m;
  TileKey low = tiles.begin()->first, high = low;
  for (auto known = projected_.begin(); known != projected_.end();) {
    known = tiles.count(known->first) > 0 ? std::next(known) : projected_.erase(known);
  }
  for (const auto& [key, tile] : tiles) {
    low.x = std::min(low.x, key.x), high.x = std::max(high.x, key.x);
    low.y = std::min(low.y, key.y), high.y = std::max(high.y, key.y);
    Column& column = projected_[key];
    if (!column.cells.empty() && column.version == tile.version) continue;
    column.version = tile.version;
    column.cells.assign(kTileSide * kTileSide, kUnknown);
    const DecodedTile decoded = decode_tile(tile.payload, map.truncation_m());
    for (int z = 0; z < kTileSide; ++z) {
      const double height_m = (key.z * kTileSide + z + 0.5) * voxel_m;
      if (height_m < config_.node.occupancy_low_m || height_m > config_.node.occupancy_high_m) {
        continue;
      }
      for (int cell = 0; cell < kTileSide * kTileSide; ++cell) {
        const int voxel = z * kTileSide * kTileSide + cell;
        if (!decoded.observed[voxel]) continue;
        const bool surface = std::abs(decoded.distance_m[voxel]) < voxel_m;
        column.cells[cell] = std::max(column.cells[cell], surface ? kOccupied : kFree);
      }
    }
  }
  const std::int64_t columns = (std::int64_t{high.x} - low.x + 1) * kTileSide;
  const std::int64_t rows = (std::int64_t{high.y} - low.y + 1) * kTileSide;
  if (columns * rows > kMostCells) return;

  nav_msgs::msg::OccupancyGrid grid;
  grid.header().stamp(to_time(stamp_ns));
  grid.header().frame_id(config_.node.map_frame);
  grid.info().map_load_time(to_time(stamp_ns));
  grid.info().resolution(static_cast<float>(voxel_m));
  grid.info().width(static_cast<std::uint32_t>(columns));
  grid.info().height(static_cast<std::uint32_t>(rows));
  grid.info().origin().position().x(low.x * kTileSide * voxel_m);
  grid.info().origin().position().y(low.y * kTileSide * voxel_m);
  grid.info().origin().orientation().w(1.0);
  grid.data().assign(static_cast<std::size_t>(columns * rows), kUnknown);
  for (const auto& [key, column] : projected_) {
    for (int y = 0; y < kTileSide; ++y) {
      const std::int64_t row = (std::int64_t{key.y} - low.y) * kTileSide + y;
      const std::int64_t start = row * columns + (std::int64_t{key.x} - low.x) * kTileSide;
      for (int x = 0; x < kTileSide; ++x) {
        auto& cell = grid.data()[static_cast<std::size_t>(start + x)];
        cell = std::max(cell, column.cells[y * kTileSide + x]);
      }
    }
  }
  grid_->write(grid);
}

}  // namespace pocd::dds
