// Surface of a single tile, so that a copy of the map can be drawn again piece by piece.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd {

/// The decoded tile of a key; null where there is none. What it returns has to stay as it is during
/// the call that asks.
using TileLookup = std::function<const DecodedTile*(const TileKey&)>;

struct TileVertex {
  /// From the centre of the tile's voxel (0, 0, 0), in voxels: each coordinate in [0, 16].
  Eigen::Vector3f position_voxels = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal_W = Eigen::Vector3f::UnitZ();  ///< unit, towards free space
  std::uint32_t owner = 0;                              ///< ObjectId index, 0: background
};

struct TileMesh {
  std::vector<TileVertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// The triangles of extract_mesh() whose cell has its lowest corner in this tile: together the
/// meshes of all tiles are the surface of the map, each triangle once. Cells reach into the seven
/// upper neighbours; normals are central differences of the distances and look at all 26. Empty
/// when the tile is not there. Like there, triangles across a tear of more than four voxels
/// (`voxel_size_m`) are left out. Thread-safe as far as `tile_of` is.
TileMesh extract_tile_mesh(const TileKey& key, double voxel_size_m, const TileLookup& tile_of);

/// The tiles whose mesh may change when this one does, itself among them: it is their neighbour.
std::vector<TileKey> tiles_drawn_with(const TileKey& key);

/// Coarser by vertex clustering (Rossignac and Borrel 1993): vertices in one cube of `cell_voxels`
/// become their mean, and triangles with two corners in one cube go. Vertices on the sides of the
/// tile keep to them, so that the coarser surfaces of neighbours meet without a gap. The owner is
/// that of most of the vertices of a cube, of the lowest id where they are as many. A surface of
/// which nothing would be left, as it stands alone in its cubes, is done with cubes of half the
/// side: no piece of the surface is gone as a whole.
TileMesh coarsened(const TileMesh& mesh, int cell_voxels);

}  // namespace pocd
