// The surface of the published map as points, kept up to date tile by tile.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd::dds {

struct SurfacePoint {
  Eigen::Vector3f position_W;  ///< map frame [m]
  std::uint32_t owner = 0;     ///< ObjectId index, 0 background
};

/// A point wherever the signed distance of two neighbouring observed voxels changes its sign. The
/// points of a tile are between its voxels and their neighbours towards +x, +y, +z, of which some
/// are in the next tile. Not thread-safe.
class SurfacePoints {
 public:
  SurfacePoints(double voxel_size_m, double truncation_m)
      : voxel_size_m_(voxel_size_m), truncation_m_(truncation_m) {}

  /// Takes over a step of the map; `tiles` is the whole map after it. Throws InputError for a
  /// payload that is no tile.
  void apply(const std::map<TileKey, MapTile>& tiles, const std::vector<TileKey>& changed,
             const std::vector<TileKey>& removed);

  const std::map<TileKey, std::vector<SurfacePoint>>& by_tile() const { return points_; }
  std::size_t size() const;

 private:
  const double voxel_size_m_, truncation_m_;
  std::map<TileKey, std::vector<SurfacePoint>> points_;
};

}  // namespace pocd::dds
