#include "pocd/map/tile_mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "map_fixtures.hpp"
#include "pocd/map/mesh.hpp"

namespace pocd::testing {
namespace {

/// Tiles of a surface that reaches over the borders of tiles, published as they would be.
/// `distance_m` of a point in the map frame.
template <class Distance>
std::map<TileKey, MapTile> tiles_of(const TsdfConfig& config, const Distance& distance_m) {
  TsdfMap map(config);
  for (int z = -20; z < 20; ++z) {
    for (int y = -20; y < 20; ++y) {
      for (int x = -26; x < 26; ++x) {
        const Eigen::Vector3d p = Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) * config.voxel_size_m;
        const double d = distance_m(p);
        VoxelBlock& block = map.touch({x >> 3, y >> 3, z >> 3});
        const int v = (x & 7) + 8 * ((y & 7) + 8 * (z & 7));
        block.weight[v] = 5;
        block.owner[v] = x < 0 ? 1 : 2;
        block.tsdf[v] = static_cast<std::int16_t>(
            std::lround(32767 * std::clamp(d / config.truncation_m(), -1.0, 1.0)));
      }
    }
  }
  MapPublisher publisher(1, config);
  publisher.update(map);
  return publisher.tiles();
}

std::map<TileKey, MapTile> two_spheres(const TsdfConfig& config) {
  return tiles_of(config, [](const Eigen::Vector3d& p) {
    return std::min((p - Eigen::Vector3d(0.4, 0.1, 0)).norm(),
                    (p + Eigen::Vector3d(0.3, 0, 0.1)).norm()) -
           0.55;
  });
}

struct Decoded {
  Decoded(const std::map<TileKey, MapTile>& tiles, double truncation_m) {
    for (const auto& [key, tile] : tiles) {
      decoded[key] = std::make_unique<DecodedTile>(decode_tile(tile.payload, truncation_m));
    }
  }
  const DecodedTile* operator()(const TileKey& key) const {
    const auto found = decoded.find(key);
    return found == decoded.end() ? nullptr : found->second.get();
  }
  std::map<TileKey, std::unique_ptr<DecodedTile>> decoded;
};

using Triangle = std::array<long, 9>;  // in tenths of a millimetre, from the lowest corner on

Triangle triangle_of(std::array<Eigen::Vector3f, 3> p) {
  std::array<std::array<long, 3>, 3> corners;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) corners[i][k] = std::lround(1e3 * p[i][k]);
  }
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  Triangle triangle;
  for (int i = 0; i < 9; ++i) triangle[i] = corners[i / 3][i % 3];
  return triangle;
}

TEST(TileMesh, TilesTogetherAreTheSurfaceOfTheMap) {
  const TsdfConfig config = coarse_config();
  const auto tiles = two_spheres(config);
  ASSERT_GT(tiles.size(), 8u);
  const Decoded decoded(tiles, config.truncation_m());
  std::vector<Triangle> pieces, whole;
  std::size_t owners[3] = {};
  for (const auto& [key, tile] : tiles) {
    const TileMesh mesh = extract_tile_mesh(key, config.voxel_size_m, std::cref(decoded));
    const Eigen::Vector3f origin =
        (kTileSide * Eigen::Vector3f(static_cast<float>(key.x), static_cast<float>(key.y),
                                     static_cast<float>(key.z)) +
         Eigen::Vector3f::Constant(0.5f)) *
        static_cast<float>(config.voxel_size_m);
    for (const TileVertex& vertex : mesh.vertices) {
      EXPECT_GE(vertex.position_voxels.minCoeff(), 0.0f);
      EXPECT_LE(vertex.position_voxels.maxCoeff(), 16.0f);
      EXPECT_NEAR(vertex.normal_W.norm(), 1.0f, 1e-4f);
      ASSERT_LE(vertex.owner, 2u);
      ++owners[vertex.owner];
    }
    for (const auto& t : mesh.triangles) {
      std::array<Eigen::Vector3f, 3> p;
      for (int i = 0; i < 3; ++i) {
        p[i] =
            origin + static_cast<float>(config.voxel_size_m) * mesh.vertices[t[i]].position_voxels;
      }
      pieces.push_back(triangle_of(p));
    }
  }
  const Mesh mesh = extract_mesh(tiles, config.voxel_size_m, config.truncation_m());
  for (const auto& t : mesh.triangles) {
    whole.push_back(
        triangle_of({mesh.vertices_W[t[0]], mesh.vertices_W[t[1]], mesh.vertices_W[t[2]]}));
  }
  EXPECT_GT(owners[1], 0u);
  EXPECT_GT(owners[2], 0u);
  ASSERT_EQ(pieces.size(), whole.size());
  std::sort(pieces.begin(), pieces.end());
  std::sort(whole.begin(), whole.end());
  // extract_mesh rounds distances to 1/32767 of the truncation: a millimetre may be the next one.
  std::size_t different = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (int k = 0; k < 9; ++k) different += std::abs(pieces[i][k] - whole[i][k]) > 1;
  }
  EXPECT_LT(different, whole.size() / 50);
}

// A thing whose front, at x = 0, is known three voxels deep: free space that was seen from the side
// lies behind the band. The tiles have the front, and not the end of the band, as the map's mesh
// has.
TEST(TileMesh, TheEndOfABandInFreeSpaceIsNoSurface) {
  const TsdfConfig config = coarse_config();
  const auto tiles = tiles_of(config, [](const Eigen::Vector3d& p) {
    const bool band = std::abs(p.y()) < 0.2 && p.x() > -0.2 && p.x() < 0.15;
    return band ? -p.x() : 0.2;
  });
  const Decoded decoded(tiles, config.truncation_m());
  std::size_t triangles = 0;
  for (const auto& [key, tile] : tiles) {
    const TileMesh mesh = extract_tile_mesh(key, config.voxel_size_m, std::cref(decoded));
    triangles += mesh.triangles.size();
    for (const TileVertex& vertex : mesh.vertices) {
      const double x = config.voxel_size_m * (16.0 * key.x + 0.5 + vertex.position_voxels.x());
      EXPECT_LT(x, 0.11) << "the back of the band, towards what was seen free";
    }
  }
  EXPECT_GT(triangles, 100u);
  const Mesh whole = extract_mesh(tiles, config.voxel_size_m, config.truncation_m());
  EXPECT_EQ(triangles, whole.triangles.size());
}

// Neighbours differ by 126, 127 or 128 steps of the tiles' distances, of which 127 are four voxels.
TEST(TileMesh, TearsAreThoseOfTheMap) {
  const TsdfConfig config = coarse_config();
  ASSERT_EQ(config.truncation_voxels, 4.0);
  Random random(7);
  const auto tiles = tiles_of(config, [&](const Eigen::Vector3d&) {
    const double steps = random.uniform(0.0, 1.0) < 0.9 ? 63.0 : 64.0;
    return (random.uniform(0.0, 1.0) < 0.5 ? -steps : steps) / 127.0 * config.truncation_m();
  });
  const Decoded decoded(tiles, config.truncation_m());
  std::size_t triangles = 0, untorn = 0;
  for (const auto& [key, tile] : tiles) {
    triangles += extract_tile_mesh(key, config.voxel_size_m, std::cref(decoded)).triangles.size();
    untorn += extract_tile_mesh(key, 1e3, std::cref(decoded)).triangles.size();
  }
  EXPECT_LT(triangles, untorn);
  EXPECT_GT(triangles, untorn / 2);
  const Mesh whole = extract_mesh(tiles, config.voxel_size_m, config.truncation_m());
  EXPECT_EQ(triangles, whole.triangles.size());
}

TEST(TileMesh, NormalsPointOutOfASphere) {
  const TsdfConfig config = coarse_config();
  const auto tiles = two_spheres(config);
  const Decoded decoded(tiles, config.truncation_m());
  const auto voxel = static_cast<float>(config.voxel_size_m);
  int looked = 0;
  for (const auto& [key, tile] : tiles) {
    for (const TileVertex& vertex :
         extract_tile_mesh(key, config.voxel_size_m, std::cref(decoded)).vertices) {
      const Eigen::Vector3f p = voxel * (vertex.position_voxels +
                                         Eigen::Vector3f(16.0f * static_cast<float>(key.x) + 0.5f,
                                                         16.0f * static_cast<float>(key.y) + 0.5f,
                                                         16.0f * static_cast<float>(key.z) + 0.5f));
      if (p.x() < 0.6f) continue;  // of the right sphere only
      // Distances have steps of truncation / 127, a tenth of a voxel here: 0.05 rad.
      EXPECT_GT(vertex.normal_W.dot((p - Eigen::Vector3f(0.4f, 0.1f, 0)).normalized()), 0.97f);
      ++looked;
    }
  }
  EXPECT_GT(looked, 50);
}

TEST(TileMesh, NothingOfATileThatIsNotThere) {
  EXPECT_TRUE(
      extract_tile_mesh({1, 2, 3}, 0.05, [](const TileKey&) { return nullptr; }).vertices.empty());
}

TEST(TileMesh, AChangedTileIsDrawnWithAllItsNeighbours) {
  const std::vector<TileKey> keys = tiles_drawn_with({0, -1, 5});
  EXPECT_EQ(keys.size(), 27u);
  for (const TileKey& key : keys) {
    EXPECT_LE(std::max({std::abs(key.x), std::abs(key.y + 1), std::abs(key.z - 5)}), 1);
  }
}

TEST(TileMesh, CoarserHasFewerTrianglesAtTheSamePlace) {
  const TsdfConfig config = coarse_config();
  const auto tiles = two_spheres(config);
  const Decoded decoded(tiles, config.truncation_m());
  std::size_t fine = 0, coarse = 0;
  for (const auto& [key, tile] : tiles) {
    const TileMesh mesh = extract_tile_mesh(key, config.voxel_size_m, std::cref(decoded));
    const TileMesh few = coarsened(mesh, 4);
    fine += mesh.triangles.size();
    coarse += few.triangles.size();
    for (const TileVertex& vertex : few.vertices) {
      float nearest = 1e9f;
      for (const TileVertex& other : mesh.vertices) {
        nearest = std::min(nearest, (vertex.position_voxels - other.position_voxels).norm());
      }
      EXPECT_LT(nearest, 4.0f);  // a mean of vertices in a cube of four voxels
    }
    for (const auto& t : few.triangles) {
      for (const std::uint32_t v : t) ASSERT_LT(v, few.vertices.size());
    }
  }
  EXPECT_GT(coarse, 0u);
  EXPECT_LT(4 * coarse, fine);
}

// A ball and a bit of dust, each in the middle of the one cube of a tile: nothing of them would be
// left.
TEST(TileMesh, WhatIsSmallAndAloneIsStillThereCoarsely) {
  for (const double radius_voxels : {1.2, 3.0, 6.0}) {
    const TsdfConfig config = coarse_config();
    const Eigen::Vector3d centre = Eigen::Vector3d::Constant(8.0 * config.voxel_size_m);
    const auto tiles = tiles_of(config, [&](const Eigen::Vector3d& p) {
      return (p - centre).norm() - radius_voxels * config.voxel_size_m;
    });
    const Decoded decoded(tiles, config.truncation_m());
    const TileMesh mesh = extract_tile_mesh({0, 0, 0}, config.voxel_size_m, std::cref(decoded));
    ASSERT_GT(mesh.triangles.size(), 0u);
    const TileMesh few = coarsened(mesh, 16);
    EXPECT_GT(few.triangles.size(), 0u) << radius_voxels;
    EXPECT_LE(few.triangles.size(), 24u) << radius_voxels;
    for (const auto& t : few.triangles) {
      for (const std::uint32_t v : t) {
        ASSERT_LT(v, few.vertices.size());
        const Eigen::Vector3f from_centre =
            few.vertices[v].position_voxels - Eigen::Vector3f::Constant(7.5f);
        EXPECT_LT(from_centre.norm(), radius_voxels + 1.0);
      }
    }
  }
}

// A floor over four tiles: the coarser surface has no gap between them.
TEST(TileMesh, CoarserSurfacesOfNeighboursMeet) {
  const TsdfConfig config = coarse_config();
  const auto tiles = tiles_of(config, [](const Eigen::Vector3d& p) { return p.z() - 0.123; });
  const Decoded decoded(tiles, config.truncation_m());
  double fine_area = 0.0, coarse_area = 0.0;
  const auto area_voxels2 = [](const TileMesh& mesh) {
    double area = 0.0;
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3f a = mesh.vertices[t[0]].position_voxels;
      const Eigen::Vector3f ab = mesh.vertices[t[1]].position_voxels - a;
      const Eigen::Vector3f ac = mesh.vertices[t[2]].position_voxels - a;
      area += 0.5 * ab.cross(ac).norm();
    }
    return area;
  };
  for (const TileKey& key :
       {TileKey{-1, -1, 0}, TileKey{0, -1, 0}, TileKey{-1, 0, 0}, TileKey{0, 0, 0}}) {
    const TileMesh mesh = extract_tile_mesh(key, config.voxel_size_m, std::cref(decoded));
    fine_area += area_voxels2(mesh);
    coarse_area += area_voxels2(coarsened(mesh, 16));
  }
  EXPECT_NEAR(fine_area, 4 * 16 * 16, 0.1);
  EXPECT_NEAR(coarse_area, fine_area, 0.1);
}

}  // namespace
}  // namespace pocd::testing
