// The 256 cases of marching cubes, derived instead of listed.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace pocd {

/// Corner c of a cell is at (c & 1, c >> 1 & 1, c >> 2). Edge e runs from corner `low` along
/// `axis`.
struct CellEdge {
  int low, axis;
};
extern const std::array<CellEdge, 12> kCellEdges;

/// Triangles of one case, as triples of edges, seen from the positive side counter-clockwise.
using CellTriangles = std::vector<std::array<std::uint8_t, 3>>;

/// Entry i: corners whose bit is set in i are inside (negative distance). Faces that are cut four
/// times always keep the inside corners apart, so that neighbouring cells agree and the surface has
/// no holes (the flaw of the 15-case table of Lorensen and Cline 1987; see Nielson and Hamann
/// 1991).
const std::array<CellTriangles, 256>& cell_cases();

/// A zero crossing between voxels that differ by more than so many voxels is no surface but a tear,
/// unless its inside is less than so deep: it lies between the band behind a silhouette and free
/// space that was seen from elsewhere. A surface that is seen at a small angle has steps as large,
/// but not so deep. The thousandth is for the rounding of distances.
inline constexpr float kTornVoxels = 4.004f, kRimVoxels = 1.0f;

/// Of a corner that nobody looked at: what is not seen lies behind surfaces, for the most part.
inline constexpr float kUnknownDistance = -std::numeric_limits<float>::infinity();

/// Calls triangle(e0, e1, e2), edges of the cell, for what of the surface lies in a cell whose
/// corners have these distances, of which one voxel is `per_voxel`; triangles across a tear are
/// left out, and those with a corner on an edge to kUnknownDistance.
template <class Triangle>
void for_each_triangle(const std::array<float, 8>& distance, float per_voxel,
                       const Triangle& triangle) {
  int inside = 0;
  for (int c = 0; c < 8; ++c) inside |= (distance[c] < 0.0f ? 1 : 0) << c;
  if (inside == 0 || inside == 255) return;
  const auto is_torn = [&](int edge) {
    const int low = kCellEdges[edge].low;
    const float p = distance[low], q = distance[low | 1 << kCellEdges[edge].axis];
    return std::abs(p - q) > kTornVoxels * per_voxel && std::min(p, q) < -kRimVoxels * per_voxel;
  };
  for (const auto& t : cell_cases()[inside]) {
    if (!is_torn(t[0]) && !is_torn(t[1]) && !is_torn(t[2])) triangle(t[0], t[1], t[2]);
  }
}

}  // namespace pocd
