// The 256 cases of marching cubes, derived instead of listed.
#pragma once

#include <array>
#include <cstdint>
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

}  // namespace pocd
