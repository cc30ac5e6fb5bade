// Surface of a TSDF as points, the common currency in which maps of different methods are compared.
#pragma once

#include "pocd/map/tsdf_map.hpp"

namespace pocd {

/// Zero crossings between neighbouring voxels of weight >= min_weight, interpolated linearly: the
/// vertices of marching cubes, without its triangles. Voxels at or above 0.9 of the truncation
/// distance are free space and bound no surface (a jump from occupied to free is the edge of what
/// was seen).
Points surface_points(const TsdfMap& map, int min_weight);

}  // namespace pocd
