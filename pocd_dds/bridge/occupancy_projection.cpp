#include "pocd_dds/bridge/occupancy_projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pocd::dds {
namespace {

// The band begins above the floor, so that the floor is no obstacle. Further below it is no floor
// that one could drive on, but a lower level or a hole.
constexpr double kFloorBelowBandM = 0.3;

}  // namespace

OccupancyProjection::Cells OccupancyProjection::project(const MapTile& tile) const {
  Cells cells;
  cells.fill(kCellUnknown);
  const DecodedTile decoded = decode_tile(tile.payload, options_.truncation_m);
  for (int z = 0; z < kTileSide; ++z) {
    const double height_m = (tile.key.z * kTileSide + z + 0.5) * options_.voxel_size_m;
    if (height_m < options_.low_m - kFloorBelowBandM || height_m > options_.high_m) continue;
    for (int cell = 0; cell < kTileSide * kTileSide; ++cell) {
      const int voxel = z * kTileSide * kTileSide + cell;
      if (!decoded.observed[voxel]) continue;
      const bool surface = std::abs(decoded.distance_m[voxel]) < options_.voxel_size_m;
      const bool occupied = surface && height_m >= options_.low_m;
      cells[cell] = std::max(cells[cell], occupied ? kCellOccupied : kCellFree);
    }
  }
  return cells;
}

void OccupancyProjection::apply(const std::vector<MapTile>& changed,
                                const std::vector<TileKey>& removed, const std::set<TileKey>& old) {
  for (const MapTile& tile : changed) {
    const Tower tower{tile.key.x, tile.key.y};
    towers_[tower][tile.key.z] = {project(tile), old.count(tile.key) > 0};
    dirty_.insert(tower);
  }
  for (const TileKey& key : removed) {
    const Tower tower{key.x, key.y};
    const auto known = towers_.find(tower);
    if (known == towers_.end() || known->second.erase(key.z) == 0) continue;
    if (known->second.empty()) towers_.erase(known);
    dirty_.insert(tower);
  }
}

OccupancyProjection::Cells OccupancyProjection::top_view(const Tower& tower) const {
  Cells cells;
  cells.fill(kCellUnknown);
  const auto known = towers_.find(tower);
  if (known == towers_.end()) return cells;
  const bool as_it_was = options_.not_looked_at == OccupancyOptions::kAsItWas;
  for (const auto& [z, layer] : known->second) {
    if (layer.old && !as_it_was) continue;
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = std::max(cells[i], layer.cells[i]);
  }
  if (as_it_was) return cells;
  // What was looked at and is in the way stays in the way.
  for (const auto& [z, layer] : known->second) {
    for (std::size_t i = 0; layer.old && i < cells.size(); ++i) {
      if (layer.cells[i] != kCellUnknown && cells[i] != kCellOccupied)
        cells[i] = static_cast<std::int8_t>(options_.not_looked_at);
    }
  }
  return cells;
}

bool OccupancyProjection::grow() {
  Tower low = low_, high = high_;
  const auto include = [&](const Tower& tower) {
    if (high.first < low.first) low = high = tower;
    low = {std::min(low.first, tower.first), std::min(low.second, tower.second)};
    high = {std::max(high.first, tower.first), std::max(high.second, tower.second)};
  };
  if (too_large_ && !dirty_.empty()) {
    // Whatever made it so may have gone.
    low = {0, 0};
    high = {-1, -1};
    for (const auto& [tower, layers] : towers_) include(tower);
  } else {
    for (const Tower& tower : dirty_) include(tower);
  }
  if (low == low_ && high == high_) return false;
  low_ = low;
  high_ = high;
  return true;
}

void OccupancyProjection::paste(const Tower& tower, const Cells& cells) {
  for (int y = 0; y < kTileSide; ++y) {
    const std::size_t row = static_cast<std::size_t>(tower.second - low_.second) * kTileSide + y;
    const std::size_t start =
        row * grid_.width + static_cast<std::size_t>(tower.first - low_.first) * kTileSide;
    std::copy_n(cells.begin() + y * kTileSide, kTileSide, grid_.cells.begin() + start);
  }
}

bool OccupancyProjection::update() {
  changed_rectangle_.reset();
  if (grow()) {
    dirty_.clear();
    const std::int64_t columns = (std::int64_t{high_.first} - low_.first + 1) * kTileSide;
    const std::int64_t rows = (std::int64_t{high_.second} - low_.second + 1) * kTileSide;
    too_large_ = columns > kMostCells || rows > kMostCells || columns * rows > kMostCells;
    grid_ = {};
    if (too_large_) return true;
    grid_.x = low_.first * kTileSide;
    grid_.y = low_.second * kTileSide;
    grid_.width = static_cast<std::uint32_t>(columns);
    grid_.height = static_cast<std::uint32_t>(rows);
    grid_.cells.assign(static_cast<std::size_t>(columns * rows), kCellUnknown);
    for (const auto& [tower, layers] : towers_) paste(tower, top_view(tower));
    return true;
  }
  if (too_large_) {
    dirty_.clear();
    return false;
  }
  const auto at = [&](std::int64_t x, std::int64_t y) -> std::int8_t& {
    return grid_.cells[static_cast<std::size_t>(y * grid_.width + x)];
  };
  std::int64_t x_low = grid_.width, y_low = grid_.height, x_high = -1, y_high = -1;
  for (const Tower& tower : dirty_) {
    const Cells cells = top_view(tower);
    for (int cell = 0; cell < kTileSide * kTileSide; ++cell) {
      const std::int64_t x =
          (std::int64_t{tower.first} - low_.first) * kTileSide + cell % kTileSide;
      const std::int64_t y =
          (std::int64_t{tower.second} - low_.second) * kTileSide + cell / kTileSide;
      if (at(x, y) == cells[cell]) continue;
      at(x, y) = cells[cell];
      x_low = std::min(x_low, x), x_high = std::max(x_high, x);
      y_low = std::min(y_low, y), y_high = std::max(y_high, y);
    }
  }
  dirty_.clear();
  if (x_high < 0) return false;
  CellRectangle changed{static_cast<std::int32_t>(x_low),
                        static_cast<std::int32_t>(y_low),
                        static_cast<std::uint32_t>(x_high - x_low + 1),
                        static_cast<std::uint32_t>(y_high - y_low + 1),
                        {}};
  for (std::int64_t y = y_low; y <= y_high; ++y) {
    const auto row = grid_.cells.begin() + y * grid_.width;
    changed.cells.insert(changed.cells.end(), row + x_low, row + x_high + 1);
  }
  changed_rectangle_ = std::move(changed);
  return false;
}

}  // namespace pocd::dds
