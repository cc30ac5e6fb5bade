#include "pocd/map/tile_mesh.hpp"

#include <algorithm>
#include <map>

#include "marching_cubes.hpp"
#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// The tile with one layer below and two above: cells end at the neighbours' first layer, and
// normals there look one further.
constexpr int kSide = kTileSide + 3;
constexpr int kCorners = kTileSide + 1;
constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

struct PaddedTile {
  std::vector<float> distance = std::vector<float>(kSide * kSide * kSide, 0.0f);
  std::vector<std::uint8_t> observed = std::vector<std::uint8_t>(kSide * kSide * kSide, 0);
  std::vector<std::uint32_t> owner = std::vector<std::uint32_t>(kSide * kSide * kSide, 0);
};

/// Voxel (x, y, z) of the tile, each from -1 to 17.
constexpr int padded(int x, int y, int z) { return x + 1 + kSide * (y + 1 + kSide * (z + 1)); }

/// Voxels of a padded axis that lie in the neighbour at `offset`, as [from, to).
std::pair<int, int> reach(int offset) {
  if (offset < 0) return {-1, 0};
  if (offset > 0) return {kTileSide, kTileSide + 2};
  return {0, kTileSide};
}

void copy_from(const DecodedTile& tile, int dx, int dy, int dz, PaddedTile& out) {
  const auto [x0, x1] = reach(dx);
  const auto [y0, y1] = reach(dy);
  const auto [z0, z1] = reach(dz);
  constexpr int mask = kTileSide - 1;
  for (int z = z0; z < z1; ++z) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const int from = (x & mask) + kTileSide * ((y & mask) + kTileSide * (z & mask));
        const int to = padded(x, y, z);
        out.distance[to] = tile.distance_m[from];
        out.observed[to] = tile.observed[from];
        out.owner[to] = tile.owner[from];
      }
    }
  }
}

/// Slope of the distance at a voxel along an axis, from what is observed; 0 when neither side is.
float slope(const PaddedTile& tile, int at, int step) {
  const bool below = tile.observed[at - step] != 0, above = tile.observed[at + step] != 0;
  if (below && above) return 0.5f * (tile.distance[at + step] - tile.distance[at - step]);
  if (above) return tile.distance[at + step] - tile.distance[at];
  if (below) return tile.distance[at] - tile.distance[at - step];
  return 0.0f;
}

Eigen::Vector3f gradient(const PaddedTile& tile, int at) {
  return {slope(tile, at, 1), slope(tile, at, kSide), slope(tile, at, kSide * kSide)};
}

class Mesher {
 public:
  Mesher(const PaddedTile& tile, float voxel_m, TileMesh& mesh)
      : tile_(tile),
        voxel_m_(voxel_m),
        mesh_(mesh),
        vertex_of_(3 * kCorners * kCorners * kCorners, kNoVertex) {}

  void cell(int x, int y, int z) {
    if (tile_.observed[padded(x, y, z)] == 0) return;
    std::array<float, 8> distance;
    for (int c = 0; c < 8; ++c) {
      const int at = padded(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
      distance[c] = tile_.observed[at] != 0 ? tile_.distance[at] : kUnknownDistance;
    }
    for_each_triangle(distance, voxel_m_, [&](int i, int j, int k) {
      mesh_.triangles.push_back({vertex(x, y, z, i), vertex(x, y, z, j), vertex(x, y, z, k)});
    });
  }

 private:
  std::uint32_t vertex(int x, int y, int z, int edge) {
    const int low = kCellEdges[edge].low, axis = kCellEdges[edge].axis;
    x += low & 1, y += low >> 1 & 1, z += low >> 2;
    std::uint32_t& number = vertex_of_[3 * (x + kCorners * (y + kCorners * z)) + axis];
    if (number != kNoVertex) return number;
    number = static_cast<std::uint32_t>(mesh_.vertices.size());
    const int a = padded(x, y, z);
    const int b = a + (axis == 0 ? 1 : axis == 1 ? kSide : kSide * kSide);
    const float share = tile_.distance[a] / (tile_.distance[a] - tile_.distance[b]);
    TileVertex vertex;
    vertex.position_voxels =
        Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    vertex.position_voxels[axis] += share;
    vertex.owner = tile_.owner[share <= 0.5f ? a : b];
    Eigen::Vector3f normal = (1.0f - share) * gradient(tile_, a) + share * gradient(tile_, b);
    if (normal.squaredNorm() < 1e-12f)
      normal = (tile_.distance[b] > tile_.distance[a] ? 1.0f : -1.0f) * Eigen::Vector3f::Unit(axis);
    vertex.normal_W = normal.normalized();
    mesh_.vertices.push_back(vertex);
    return number;
  }

  const PaddedTile& tile_;
  const float voxel_m_;
  TileMesh& mesh_;
  std::vector<std::uint32_t> vertex_of_;
};

template <class Use>
void for_each_neighbour(const TileKey& key, const Use& use) {
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        use(TileKey{key.x + dx, key.y + dy, key.z + dz}, dx, dy, dz);
      }
    }
  }
}

}  // namespace

TileMesh extract_tile_mesh(const TileKey& key, double voxel_size_m, const TileLookup& tile_of) {
  TileMesh mesh;
  if (tile_of(key) == nullptr) return mesh;
  PaddedTile tile;
  for_each_neighbour(key, [&](const TileKey& neighbour, int dx, int dy, int dz) {
    const DecodedTile* decoded = tile_of(neighbour);
    if (decoded != nullptr) copy_from(*decoded, dx, dy, dz, tile);
  });
  Mesher mesher(tile, static_cast<float>(voxel_size_m), mesh);
  for (int z = 0; z < kTileSide; ++z) {
    for (int y = 0; y < kTileSide; ++y) {
      for (int x = 0; x < kTileSide; ++x) mesher.cell(x, y, z);
    }
  }
  return mesh;
}

std::vector<TileKey> tiles_drawn_with(const TileKey& key) {
  std::vector<TileKey> keys;
  for_each_neighbour(key,
                     [&](const TileKey& neighbour, int, int, int) { keys.push_back(neighbour); });
  return keys;
}

namespace {

/// Appends those triangles of `mesh` of which every corner is `lone`, made coarser by half a cube.
void append_lone(const TileMesh& mesh, const std::vector<bool>& lone, int cell_voxels,
                 TileMesh& coarse) {
  TileMesh left_out;
  std::map<std::uint32_t, std::uint32_t> number_of;
  for (const auto& triangle : mesh.triangles) {
    if (!lone[triangle[0]] || !lone[triangle[1]] || !lone[triangle[2]]) continue;
    std::array<std::uint32_t, 3>& corner = left_out.triangles.emplace_back();
    for (int i = 0; i < 3; ++i) {
      const auto next = static_cast<std::uint32_t>(left_out.vertices.size());
      const auto [known, is_new] = number_of.emplace(triangle[i], next);
      if (is_new) left_out.vertices.push_back(mesh.vertices[triangle[i]]);
      corner[i] = known->second;
    }
  }
  if (left_out.triangles.empty()) return;
  if (cell_voxels > 1) left_out = coarsened(left_out, cell_voxels / 2);
  const auto first = static_cast<std::uint32_t>(coarse.vertices.size());
  coarse.vertices.insert(coarse.vertices.end(), left_out.vertices.begin(), left_out.vertices.end());
  for (const auto& triangle : left_out.triangles) {
    coarse.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }
}

}  // namespace

TileMesh coarsened(const TileMesh& mesh, int cell_voxels) {
  POCD_CHECK(cell_voxels > 0);
  struct Cluster {
    std::uint32_t number = 0;
    int count = 0;
    Eigen::Vector3f position = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
    std::map<std::uint32_t, int> owners;
  };
  std::map<std::array<int, 3>, Cluster> clusters;  // ordered: equal meshes give equal results
  std::vector<std::array<int, 3>> cell_of;
  for (const TileVertex& vertex : mesh.vertices) {
    std::array<int, 3> cell;
    for (int i = 0; i < 3; ++i) {
      // What lies on the border to a neighbour stays there: the neighbour has the same vertices.
      const float at = vertex.position_voxels[i];
      cell[i] = at <= 0.0f ? -1 : at >= kTileSide ? kTileSide : static_cast<int>(at) / cell_voxels;
    }
    Cluster& cluster = clusters[cell];
    ++cluster.count;
    cluster.position += vertex.position_voxels;
    cluster.normal += vertex.normal_W;
    ++cluster.owners[vertex.owner];
    cell_of.push_back(cell);
  }
  TileMesh coarse;
  for (auto& [cell, cluster] : clusters) {
    cluster.number = static_cast<std::uint32_t>(coarse.vertices.size());
    TileVertex vertex;
    vertex.position_voxels = cluster.position / static_cast<float>(cluster.count);
    if (cluster.normal.squaredNorm() > 1e-6f) vertex.normal_W = cluster.normal.normalized();
    vertex.owner =
        std::max_element(cluster.owners.begin(), cluster.owners.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; })
            ->first;
    coarse.vertices.push_back(vertex);
  }
  for (const auto& triangle : mesh.triangles) {
    std::array<std::uint32_t, 3> corner;
    for (int i = 0; i < 3; ++i) corner[i] = clusters[cell_of[triangle[i]]].number;
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    coarse.triangles.push_back(corner);
  }
  std::sort(coarse.triangles.begin(), coarse.triangles.end());
  coarse.triangles.erase(std::unique(coarse.triangles.begin(), coarse.triangles.end()),
                         coarse.triangles.end());
  // What stands alone in its cubes would be gone.
  std::vector<bool> drawn(coarse.vertices.size(), false);
  for (const auto& triangle : coarse.triangles) {
    for (const std::uint32_t v : triangle) drawn[v] = true;
  }
  std::vector<bool> lone(mesh.vertices.size());
  for (std::size_t v = 0; v < lone.size(); ++v) lone[v] = !drawn[clusters[cell_of[v]].number];
  append_lone(mesh, lone, cell_voxels, coarse);
  return coarse;
}

}  // namespace pocd
