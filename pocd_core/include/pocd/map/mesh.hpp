// Surface of the map as triangles (marching cubes) and PLY files.
#pragma once

#include <filesystem>
#include <functional>

#include "pocd/map/map_delta.hpp"
#include "pocd/map/tsdf_map.hpp"

namespace pocd {

/// Indexed triangles in the map frame [m]. `owner` has one entry per vertex (ObjectId index).
struct Mesh {
  Points vertices_W;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> owner;
};

/// Lorensen and Cline 1987 over every cell whose lowest voxel was observed, with weight >=
/// min_weight; of the others, those at the ends of a triangle's cut edges must be: surface shows up
/// to where nothing was seen. Vertices shared between cells are merged, order is that of
/// TsdfMap::keys_by_region, so equal maps give equal meshes.
Mesh extract_mesh(const TsdfMap& map, int min_weight, ThreadPool& pool);

/// The same from a copy of the published tiles (what a subscriber holds).
Mesh extract_mesh(const std::map<TileKey, MapTile>& tiles, double voxel_size_m,
                  double truncation_m);

/// Colour (RGB) and class of an object, for files people look at.
struct OwnerAppearance {
  std::array<std::uint8_t, 3> rgb{160, 160, 160};
  ClassId class_id = 0;
};
using AppearanceOf = std::function<OwnerAppearance(std::uint32_t owner)>;

/// Binary little-endian PLY: vertex x y z (float, metres, map frame), red green blue (uchar),
/// class (ushort), object (uint); face vertex_indices. Throws InputError naming the file when it
/// cannot be written in full.
void write_ply(const Mesh& mesh, const AppearanceOf& appearance, const std::filesystem::path& file);

}  // namespace pocd
