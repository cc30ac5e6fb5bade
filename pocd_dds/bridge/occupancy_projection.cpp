#include "pocd_dds/bridge/occupancy_projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "pocd/common/check.hpp"

namespace pocd::dds {
namespace {

// The band begins above the floor, so that the floor is no obstacle. Further below it is no floor
// that one could drive on, but a lower level or a hole.
constexpr double kFloorBelowBandM = 0.3;

}  // namespace

CellRectangle cells_around(double min_x_m, double min_y_m, double max_x_m, double max_y_m,
                           double cell_m) {
  constexpr double kRounding = 1e-6;  // of a cell
  const double x_low = std::floor(min_x_m / cell_m + kRounding);
  const double y_low = std::floor(min_y_m / cell_m + kRounding);
  const double columns = std::ceil(max_x_m / cell_m - kRounding) - x_low;
  const double rows = std::ceil(max_y_m / cell_m - kRounding) - y_low;
  if (columns * rows > static_cast<double>(OccupancyProjection::kMostCells)) {
    throw InputError("node.outputs.occupancy_extent: more than " +
                     std::to_string(OccupancyProjection::kMostCells) + " cells");
  }
  return {static_cast<std::int32_t>(x_low),
          static_cast<std::int32_t>(y_low),
          static_cast<std::uint32_t>(columns),
          static_cast<std::uint32_t>(rows),
          {}};
}

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

void OccupancyProjection::paste(const Tower& tower, const Cells& cells, Span& changed) {
  const std::int64_t x0 = std::int64_t{tower.first} * kTileSide - grid_.x;
  const std::int64_t y0 = std::int64_t{tower.second} * kTileSide - grid_.y;
  for (int cell = 0; cell < kTileSide * kTileSide; ++cell) {
    const std::int64_t x = x0 + cell % kTileSide, y = y0 + cell / kTileSide;
    if (x < 0 || y < 0 || x >= grid_.width || y >= grid_.height) {
      cut_ = cut_ || cells[cell] != kCellUnknown;
      continue;
    }
    std::int8_t& value = grid_.cells[static_cast<std::size_t>(y * grid_.width + x)];
    if (value == cells[cell]) continue;
    value = cells[cell];
    changed.x_low = std::min(changed.x_low, x), changed.x_high = std::max(changed.x_high, x);
    changed.y_low = std::min(changed.y_low, y), changed.y_high = std::max(changed.y_high, y);
  }
}

bool OccupancyProjection::begin_grid() {
  const bool fixed = options_.extent.width > 0;
  if (fixed ? grid_.width > 0 : !grow()) return false;
  CellRectangle grid = options_.extent;
  if (!fixed) {
    const std::int64_t columns = (std::int64_t{high_.first} - low_.first + 1) * kTileSide;
    const std::int64_t rows = (std::int64_t{high_.second} - low_.second + 1) * kTileSide;
    too_large_ = columns > kMostCells || rows > kMostCells || columns * rows > kMostCells;
    if (too_large_) {
      grid_ = {};
      return true;
    }
    grid = {low_.first * kTileSide,
            low_.second * kTileSide,
            static_cast<std::uint32_t>(columns),
            static_cast<std::uint32_t>(rows),
            {}};
  }
  grid_ = std::move(grid);
  grid_.cells.assign(std::size_t{grid_.width} * grid_.height, kCellUnknown);
  return true;
}

bool OccupancyProjection::update() {
  changed_rectangle_.reset();
  const bool anew = begin_grid();
  if (too_large_) {
    dirty_.clear();
    return anew;
  }
  Span span{grid_.width, grid_.height, -1, -1};
  if (anew) {
    for (const auto& [tower, layers] : towers_) paste(tower, top_view(tower), span);
  } else {
    for (const Tower& tower : dirty_) paste(tower, top_view(tower), span);
  }
  dirty_.clear();
  if (anew || span.x_high < 0) return anew;
  CellRectangle changed{static_cast<std::int32_t>(span.x_low),
                        static_cast<std::int32_t>(span.y_low),
                        static_cast<std::uint32_t>(span.x_high - span.x_low + 1),
                        static_cast<std::uint32_t>(span.y_high - span.y_low + 1),
                        {}};
  for (std::int64_t y = span.y_low; y <= span.y_high; ++y) {
    const auto row = grid_.cells.begin() + y * grid_.width;
    changed.cells.insert(changed.cells.end(), row + span.x_low, row + span.x_high + 1);
  }
  changed_rectangle_ = std::move(changed);
  return false;
}

}  // namespace pocd::dds
