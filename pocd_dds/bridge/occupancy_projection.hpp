// The published map seen from above, as nav_msgs/OccupancyGrid and map_msgs/OccupancyGridUpdate
// have it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd::dds {

/// Values of a cell.
constexpr std::int8_t kCellUnknown = -1, kCellFree = 0, kCellOccupied = 100;

/// Cells [x, x + width) x [y, y + height), row-major, x fastest.
struct CellRectangle {
  std::int32_t x = 0, y = 0;
  std::uint32_t width = 0, height = 0;
  std::vector<std::int8_t> cells;
};

struct OccupancyOptions {
  double voxel_size_m = 0.05;
  double truncation_m = 0.2;
  double low_m = 0.1;   ///< heights from here
  double high_m = 2.0;  ///< to here decide whether a cell is occupied
  /// Value of what nobody has looked at for long; kAsItWas: as if somebody had.
  int not_looked_at = kCellUnknown;
  static constexpr int kAsItWas = -2;
  /// What the grid shows (its cells are not used); width 0: what the map covers.
  CellRectangle extent = {};
};

/// The smallest rectangle of cells around one in metres: edges that lie on an edge of cells, but
/// for rounding, take no further cell. Throws InputError for one of more cells than a grid may
/// have.
CellRectangle cells_around(double min_x_m, double min_y_m, double max_x_m, double max_y_m,
                           double cell_m);

/// One cell per voxel column. Occupied: a surface within the band. Free: within the band free space
/// was seen, or a floor not far below it, and no surface. Unknown: the rest. Without a fixed extent
/// the grid grows with the map and does not shrink, so a cell keeps its place for as long as the
/// size stays; but one that became too large begins anew around what there is. With one, it has its
/// size from the first update() on, and what lies outside is left out. Not thread-safe.
class OccupancyProjection {
 public:
  /// A grid of more cells is no picture any more, and a mistaken far tile must not eat all memory.
  static constexpr std::int64_t kMostCells = 64'000'000;

  explicit OccupancyProjection(const OccupancyOptions& options) : options_(options) {}

  /// Takes over a step of the map. `old`: those of the changed tiles that nobody has looked at for
  /// long. Throws InputError for a payload that is no tile.
  void apply(const std::vector<MapTile>& changed, const std::vector<TileKey>& removed,
             const std::set<TileKey>& old = {});

  /// Brings the grid up to date. True: its size or place is another than before, and a rectangle of
  /// before means nothing any more; changed_rectangle() is empty then.
  bool update();
  /// The smallest rectangle around all cells that the last update() changed.
  const std::optional<CellRectangle>& changed_rectangle() const { return changed_rectangle_; }

  /// The whole grid; x and y count from the map frame's origin in cells. Empty without a map, or
  /// when it would be too large.
  const CellRectangle& grid() const { return grid_; }
  bool too_large() const { return too_large_; }
  /// Part of the map lies outside of the fixed extent.
  bool cut() const { return cut_; }

 private:
  using Tower = std::pair<std::int32_t, std::int32_t>;  // x, y of the tiles above one another
  using Cells = std::array<std::int8_t, kTileSide * kTileSide>;

  struct Layer {
    Cells cells;
    bool old = false;
  };

  Cells project(const MapTile& tile) const;
  Cells top_view(const Tower& tower) const;
  bool grow();
  /// Puts the tower's cells into the grid, and returns the rectangle around those that changed.
  struct Span {
    std::int64_t x_low, y_low, x_high, y_high;
  };
  void paste(const Tower& tower, const Cells& cells, Span& changed);
  bool begin_grid();

  const OccupancyOptions options_;
  std::map<Tower, std::map<std::int32_t, Layer>> towers_;  // by z
  std::set<Tower> dirty_;
  // Of all towers ever, as long as that is not too large; none at first.
  Tower low_{0, 0}, high_{-1, -1};
  CellRectangle grid_;
  std::optional<CellRectangle> changed_rectangle_;
  bool too_large_ = false;
  bool cut_ = false;
};

}  // namespace pocd::dds
