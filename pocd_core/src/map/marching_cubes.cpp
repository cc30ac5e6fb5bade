#include "marching_cubes.hpp"

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr int kNone = -1;

// Corners of each face, counter-clockwise seen from outside the cell.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int edge_between(int a, int b) {
  const int low = a < b ? a : b;
  for (int e = 0; e < 12; ++e) {
    if (kCellEdges[e].low == low && (low | 1 << kCellEdges[e].axis) == (a | b)) return e;
  }
  POCD_CHECK(false);
  return kNone;
}

// Walking around a face, the surface line of a run of inside corners starts at the edge that enters
// the run and ends at the edge that leaves it. An edge left on one face is entered on the other
// face it belongs to, so the lines join to closed loops.
std::array<int, 12> surface_lines(int inside) {
  std::array<int, 12> next;
  next.fill(kNone);
  for (const auto& face : kFaces) {
    for (int i = 0; i < 4; ++i) {
      const int a = face[i], b = face[(i + 1) % 4];
      const bool enters = !(inside >> a & 1) && (inside >> b & 1);
      if (!enters) continue;
      int j = (i + 1) % 4;
      while (inside >> face[(j + 1) % 4] & 1) j = (j + 1) % 4;
      next[edge_between(a, b)] = edge_between(face[j], face[(j + 1) % 4]);
    }
  }
  return next;
}

CellTriangles triangles_of(int inside) {
  CellTriangles triangles;
  std::array<int, 12> next = surface_lines(inside);
  for (int start = 0; start < 12; ++start) {
    if (next[start] == kNone) continue;
    std::vector<int> loop;
    for (int e = start; next[e] != kNone;) {
      loop.push_back(e);
      const int to = next[e];
      next[e] = kNone;
      e = to;
    }
    for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
      triangles.push_back({static_cast<std::uint8_t>(loop[0]), static_cast<std::uint8_t>(loop[i]),
                           static_cast<std::uint8_t>(loop[i + 1])});
    }
  }
  return triangles;
}

}  // namespace

const std::array<CellEdge, 12> kCellEdges = {{{0, 0},
                                              {2, 0},
                                              {4, 0},
                                              {6, 0},
                                              {0, 1},
                                              {1, 1},
                                              {4, 1},
                                              {5, 1},
                                              {0, 2},
                                              {1, 2},
                                              {2, 2},
                                              {3, 2}}};

const std::array<CellTriangles, 256>& cell_cases() {
  static const std::array<CellTriangles, 256> cases = [] {
    std::array<CellTriangles, 256> all;
    for (int i = 0; i < 256; ++i) all[i] = triangles_of(i);
    return all;
  }();
  return cases;
}

}  // namespace pocd
