#include "pocd/map/mesh.hpp"

#include <algorithm>
#include <cmath>

#include "marching_cubes.hpp"
#include "pocd/map/map_reader.hpp"
#include "tsdf_kernel.hpp"

namespace pocd {
namespace {

constexpr int kSide = VoxelBlock::kSide;
constexpr int kPadded = kSide + 1;
// Blocks per piece of work: about two regions, because each piece reads what is on disk anew.
constexpr std::size_t kGrain = 256;

// A block with one layer of its neighbours at the upper sides.
struct PaddedBlock {
  std::int16_t tsdf[kPadded * kPadded * kPadded];
  bool valid[kPadded * kPadded * kPadded];
  std::uint32_t owner[kPadded * kPadded * kPadded];
};

constexpr int padded_index(int x, int y, int z) { return x + kPadded * (y + kPadded * z); }

void fill(MapReader& map, const BlockKey& key, int min_weight, PaddedBlock& out) {
  const VoxelBlock* blocks[8];
  for (int n = 0; n < 8; ++n) {
    blocks[n] = map.find({key.x + (n & 1), key.y + (n >> 1 & 1), key.z + (n >> 2)});
  }
  int i = 0;
  for (int z = 0; z < kPadded; ++z) {
    for (int y = 0; y < kPadded; ++y) {
      for (int x = 0; x < kPadded; ++x, ++i) {
        const VoxelBlock* block = blocks[(x >> 3) + 2 * (y >> 3) + 4 * (z >> 3)];
        const int v = (x & 7) + kSide * ((y & 7) + kSide * (z & 7));
        out.valid[i] = block && block->weight[v] >= min_weight;
        out.tsdf[i] = out.valid[i] ? block->tsdf[v] : 0;
        out.owner[i] = out.valid[i] ? block->owner[v] : 0;
      }
    }
  }
}

// What one block contributes. A vertex belongs to the block of the lower voxel of its edge; its
// code is 3 * voxel + axis, ascending.
struct BlockMesh {
  std::vector<std::uint16_t> codes;
  Points vertices_W;
  std::vector<std::uint32_t> owner;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

void make_vertices(MapReader& map, const BlockKey& key, double voxel_m, int min_weight,
                   BlockMesh& out) {
  PaddedBlock block;
  fill(map, key, min_weight, block);
  for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
    const int at[3] = {v & 7, v >> 3 & 7, v >> 6};
    const int a = padded_index(at[0], at[1], at[2]);
    for (int axis = 0; axis < 3; ++axis) {
      const int b = padded_index(at[0] + (axis == 0), at[1] + (axis == 1), at[2] + (axis == 2));
      if (!block.valid[a] || !block.valid[b] || (block.tsdf[a] < 0) == (block.tsdf[b] < 0))
        continue;
      const double share = static_cast<double>(block.tsdf[a]) / (block.tsdf[a] - block.tsdf[b]);
      Eigen::Vector3d p(8.0 * key.x + at[0] + 0.5, 8.0 * key.y + at[1] + 0.5,
                        8.0 * key.z + at[2] + 0.5);
      p[axis] += share;
      out.codes.push_back(static_cast<std::uint16_t>(3 * v + axis));
      out.vertices_W.push_back((p * voxel_m).cast<float>());
      out.owner.push_back(block.owner[share <= 0.5 ? a : b]);
    }
  }
}

// Calls triangle(i, j, k) with (block offset 0..7, code) pairs packed as 2048 * offset + code.
template <class Triangle>
void for_each_triangle(MapReader& map, const BlockKey& key, int min_weight, float per_voxel,
                       const Triangle& triangle) {
  PaddedBlock block;
  fill(map, key, min_weight, block);
  for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
    const int x = v & 7, y = v >> 3 & 7, z = v >> 6;
    if (!block.valid[padded_index(x, y, z)]) continue;
    std::array<float, 8> tsdf;
    for (int c = 0; c < 8; ++c) {
      const int i = padded_index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
      tsdf[c] = block.valid[i] ? block.tsdf[i] : kUnknownDistance;
    }
    const auto locate = [&](int edge) {
      const int low = kCellEdges[edge].low;
      const int ex = x + (low & 1), ey = y + (low >> 1 & 1), ez = z + (low >> 2);
      const int offset = (ex >> 3) + 2 * (ey >> 3) + 4 * (ez >> 3);
      return 2048 * offset + 3 * ((ex & 7) + kSide * ((ey & 7) + kSide * (ez & 7))) +
             kCellEdges[edge].axis;
    };
    pocd::for_each_triangle(
        tsdf, per_voxel, [&](int i, int j, int k) { triangle(locate(i), locate(j), locate(k)); });
  }
}

// Drops vertices that no triangle uses: edges that are cut but lie in no complete cell.
Mesh compact(const std::vector<BlockMesh>& parts, const std::vector<std::uint32_t>& first,
             std::size_t vertex_count) {
  std::vector<std::uint32_t> number(vertex_count, 0);
  Mesh mesh;
  for (const BlockMesh& part : parts) {
    for (const auto& t : part.triangles) {
      for (const std::uint32_t v : t) number[v] = 1;
    }
  }
  for (std::size_t b = 0; b < parts.size(); ++b) {
    for (std::size_t i = 0; i < parts[b].codes.size(); ++i) {
      std::uint32_t& n = number[first[b] + i];
      if (n == 0) continue;
      n = static_cast<std::uint32_t>(mesh.vertices_W.size());
      mesh.vertices_W.push_back(parts[b].vertices_W[i]);
      mesh.owner.push_back(parts[b].owner[i]);
    }
  }
  for (const BlockMesh& part : parts) {
    for (const auto& t : part.triangles) {
      mesh.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    }
  }
  return mesh;
}

}  // namespace

Mesh extract_mesh(const TsdfMap& map, int min_weight, ThreadPool& pool) {
  const int threshold = std::max(min_weight, 1);
  const double voxel_m = map.config().voxel_size_m;
  const float per_voxel = kTsdfScale / static_cast<float>(map.config().truncation_voxels);
  // Region by region, so that none has to be read from disk often.
  const std::vector<BlockKey> keys = map.keys_by_region();
  const auto before = [](const BlockKey& a, const BlockKey& b) {
    return a.region() == b.region() ? a < b : a.region() < b.region();
  };
  std::vector<BlockMesh> parts(keys.size());
  pool.parallel_for(keys.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    MapReader reader(map);
    for (std::size_t b = begin; b < end; ++b) {
      make_vertices(reader, keys[b], voxel_m, threshold, parts[b]);
    }
  });
  std::vector<std::uint32_t> first(keys.size() + 1, 0);
  for (std::size_t b = 0; b < keys.size(); ++b) {
    first[b + 1] = first[b] + static_cast<std::uint32_t>(parts[b].codes.size());
  }
  pool.parallel_for(keys.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    MapReader reader(map);
    for (std::size_t b = begin; b < end; ++b) {
      std::array<std::size_t, 8> neighbour;
      for (int n = 0; n < 8; ++n) {
        const BlockKey key{keys[b].x + (n & 1), keys[b].y + (n >> 1 & 1), keys[b].z + (n >> 2)};
        neighbour[n] = std::lower_bound(keys.begin(), keys.end(), key, before) - keys.begin();
      }
      const auto vertex = [&](int packed) {
        const std::size_t block = neighbour[packed >> 11];
        const std::vector<std::uint16_t>& codes = parts[block].codes;
        const auto at = std::lower_bound(codes.begin(), codes.end(), packed & 2047);
        return first[block] + static_cast<std::uint32_t>(at - codes.begin());
      };
      for_each_triangle(reader, keys[b], threshold, per_voxel, [&](int i, int j, int k) {
        parts[b].triangles.push_back({vertex(i), vertex(j), vertex(k)});
      });
    }
  });
  return compact(parts, first, first.back());
}

Mesh extract_mesh(const std::map<TileKey, MapTile>& tiles, double voxel_size_m,
                  double truncation_m) {
  TsdfConfig config;
  config.voxel_size_m = voxel_size_m;
  config.truncation_voxels = truncation_m / voxel_size_m;
  TsdfMap map(config);
  for (const auto& [key, tile] : tiles) {
    const DecodedTile decoded = decode_tile(tile.payload, truncation_m);
    for (int n = 0; n < 8; ++n) {
      VoxelBlock& block =
          map.touch({2 * key.x + (n & 1), 2 * key.y + (n >> 1 & 1), 2 * key.z + (n >> 2)});
      for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
        const int x = (v & 7) + 8 * (n & 1), y = (v >> 3 & 7) + 8 * (n >> 1 & 1);
        const int z = (v >> 6) + 8 * (n >> 2);
        const int i = x + kTileSide * (y + kTileSide * z);
        block.weight[v] = decoded.observed[i];
        block.owner[v] = decoded.owner[i];
        block.tsdf[v] = static_cast<std::int16_t>(
            std::lround(decoded.distance_m[i] / truncation_m * kTsdfScale));
      }
    }
  }
  ThreadPool pool(1);
  return extract_mesh(map, 1, pool);
}

}  // namespace pocd
