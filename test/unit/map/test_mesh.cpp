#include "pocd/map/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>

#include "map_fixtures.hpp"
#include "pocd/common/check.hpp"

namespace pocd::testing {
namespace {

// A map written by hand from a distance function; every voxel within `reach` voxels is observed.
TsdfMap map_of(const std::function<double(const Eigen::Vector3d&)>& distance_m, int reach,
               const TsdfConfig& config = coarse_config()) {
  TsdfMap map(config);
  for (int z = -reach; z < reach; ++z) {
    for (int y = -reach; y < reach; ++y) {
      for (int x = -reach; x < reach; ++x) {
        VoxelBlock& block = map.touch({x >> 3, y >> 3, z >> 3});
        const int v = (x & 7) + 8 * ((y & 7) + 8 * (z & 7));
        const double d =
            distance_m(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) * config.voxel_size_m);
        block.weight[v] = 5;
        block.owner[v] = x < 0 ? 1 : 2;
        block.tsdf[v] = static_cast<std::int16_t>(
            std::lround(32767 * std::clamp(d / config.truncation_m(), -1.0, 1.0)));
      }
    }
  }
  return map;
}

// Every directed edge is met once, and its reverse once: closed and consistently oriented.
void expect_closed(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  int open = 0;
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    open += back == edges.end() || back->second != count;
  }
  EXPECT_EQ(open, 0) << "of " << edges.size();
}

double signed_volume(const Mesh& mesh) {
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    volume += mesh.vertices_W[t[0]].cast<double>().dot(mesh.vertices_W[t[1]].cast<double>().cross(
                  mesh.vertices_W[t[2]].cast<double>())) /
              6.0;
  }
  return volume;
}

TEST(Mesh, SphereIsClosedAndOnTheSurface) {
  ThreadPool pool(2);
  const double r = 0.6;
  const TsdfMap map = map_of([r](const Eigen::Vector3d& p) { return p.norm() - r; }, 20);
  const Mesh mesh = extract_mesh(map, 2, pool);
  ASSERT_GT(mesh.triangles.size(), 1000u);
  expect_closed(mesh);
  // Interpolating a distance to a sphere linearly over a voxel of 5 cm errs by h^2 / (8 r) = 0.5
  // mm, and along an edge oblique to the surface by up to three times that.
  for (const Eigen::Vector3f& p : mesh.vertices_W) EXPECT_NEAR(p.norm(), r, 0.0016);
  // Outward normals give a positive volume; a polyhedron inside the sphere has a little less.
  EXPECT_NEAR(signed_volume(mesh), 4.0 / 3.0 * M_PI * r * r * r, 0.01 * r * r * r * 4);
  // Euler: V - E + F = 2 for a closed surface without holes, and E = 3 F / 2.
  EXPECT_EQ(
      static_cast<long>(mesh.vertices_W.size()) - static_cast<long>(mesh.triangles.size()) / 2, 2);
}

// Noise makes every one of the 256 cases and ambiguous faces; the surface must stay closed.
TEST(Mesh, RandomDistancesGiveAClosedSurface) {
  ThreadPool pool(1);
  Random random(4);
  const TsdfMap map = map_of(
      [&random](const Eigen::Vector3d& p) {
        // Neighbours that differ by more than four voxels are torn apart.
        return p.cwiseAbs().maxCoeff() > 0.55 ? 0.099 : random.uniform(-0.099, 0.099);
      },
      12);
  const Mesh mesh = extract_mesh(map, 1, pool);
  EXPECT_GT(mesh.triangles.size(), 5000u);
  expect_closed(mesh);
}

// The band that a silhouette leaves behind it ends in free space that was seen from the side: its
// end is no surface. Here the front of a thing, at x = 0, is known three voxels deep, over half of
// it.
TEST(Mesh, TheEndOfABandInFreeSpaceIsNoSurface) {
  ThreadPool pool(1);
  const auto is_band = [](const Eigen::Vector3d& p) { return std::abs(p.y()) < 0.2; };
  const TsdfMap map = map_of(
      [&](const Eigen::Vector3d& p) {
        if (!is_band(p) || p.x() < -0.2) return 0.2;
        return p.x() > 0.15 ? 0.2 : -p.x();
      },
      12);
  const Mesh mesh = extract_mesh(map, 2, pool);
  ASSERT_GT(mesh.triangles.size(), 100u);
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t i : t) {
      const Eigen::Vector3f& p = mesh.vertices_W[i];
      EXPECT_LT(p.x(), 0.11f) << "the back of the band, towards what was seen free";
    }
  }
}

// Along rays that meet a plane at 12 degrees the distance grows by more than four voxels from voxel
// to voxel, as across a tear; but just behind the plane it is small.
TEST(Mesh, ASurfaceSeenAtASmallAngleIsNoTear) {
  ThreadPool pool(1);
  const auto triangles = [&](double plane_m) {
    return extract_mesh(
               map_of([&](const Eigen::Vector3d& p) { return 4.6 * (p.z() - plane_m); }, 8), 5,
               pool)
        .triangles.size();
  };
  EXPECT_EQ(triangles(-0.02), 15u * 15u * 2u) << "inside by 2.3 cm";
  EXPECT_EQ(triangles(0.005), 0u) << "inside by 14 cm: it may as well be the end of a band";
}

// A plane between the voxels z = 0 and z = 1, of which some were never observed.
TEST(Mesh, SurfaceShowsUpToWhereNothingWasObserved) {
  ThreadPool pool(1);
  TsdfMap map = map_of([](const Eigen::Vector3d& p) { return p.z() - 0.03; }, 8);
  const Mesh whole = extract_mesh(map, 5, pool);
  EXPECT_EQ(whole.triangles.size(), 15u * 15u * 2u);
  EXPECT_EQ(whole.vertices_W.size(), 16u * 16u);
  EXPECT_TRUE(extract_mesh(map, 6, pool).triangles.empty());
  map.touch({0, 0, 0}).weight[0] = 0;  // voxel (0, 0, 0), just below the plane
  const Mesh holed = extract_mesh(map, 5, pool);
  // Of the four cells around it, those triangles go that had the vertex above it, and the cell of
  // which it is the lowest voxel.
  EXPECT_LT(holed.triangles.size(), whole.triangles.size());
  EXPECT_GT(holed.triangles.size(), 15u * 15u * 2u - 8u);
  EXPECT_EQ(holed.vertices_W.size(), 16u * 16u - 1u);  // no vertex is left without a triangle
  // A strip that is one voxel wide, as between two things that stand before it.
  for (int y = -8; y < 8; ++y) {
    for (int x = -8; x < 8; ++x) {
      if (x == 2 || x == 3) continue;
      map.touch({x >> 3, y >> 3, 0}).weight[(x & 7) + 8 * (y & 7)] = 0;
    }
  }
  EXPECT_EQ(extract_mesh(map, 5, pool).triangles.size(), 15u * 2u);
}

TEST(Mesh, OwnersFollowTheVoxels) {
  ThreadPool pool(1);
  const Mesh mesh =
      extract_mesh(map_of([](const Eigen::Vector3d& p) { return p.norm() - 0.4; }, 12), 1, pool);
  for (std::size_t i = 0; i < mesh.vertices_W.size(); ++i) {
    if (std::abs(mesh.vertices_W[i].x()) < 0.026) continue;  // between voxels of both
    EXPECT_EQ(mesh.owner[i], mesh.vertices_W[i].x() < 0 ? 1u : 2u);
  }
}

TEST(Mesh, SameForEveryThreadCountAndNearlySameFromTiles) {
  const TsdfConfig config = coarse_config();
  TsdfMap map = map_of([](const Eigen::Vector3d& p) { return p.norm() - 0.5; }, 16);
  ThreadPool one(1), three(3);
  const Mesh a = extract_mesh(map, 2, one), b = extract_mesh(map, 2, three);
  EXPECT_EQ(a.vertices_W, b.vertices_W);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.owner, b.owner);
  MapPublisher publisher(1, config);
  publisher.update(map);
  const Mesh c = extract_mesh(publisher.tiles(), config.voxel_size_m, config.truncation_m());
  expect_closed(c);
  // Each end of an edge is off by 1/254 of the truncation, 0.8 mm.
  for (const Eigen::Vector3f& p : c.vertices_W) EXPECT_NEAR(p.norm(), 0.5, 0.002 + 0.0008);
}

TEST(Mesh, PlyHasTheDocumentedHeaderAndSize) {
  ThreadPool pool(1);
  const Mesh mesh =
      extract_mesh(map_of([](const Eigen::Vector3d& p) { return p.norm() - 0.3; }, 10), 1, pool);
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "pocd_test_mesh.ply";
  write_ply(
      mesh,
      [](std::uint32_t owner) {
        return OwnerAppearance{{10, 20, static_cast<std::uint8_t>(owner)}, 513};
      },
      file);
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment metres, map frame\nelement vertex " +
      std::to_string(mesh.vertices_W.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nproperty ushort class\nproperty uint object\n"
      "element face " +
      std::to_string(mesh.triangles.size()) +
      "\nproperty list uchar int vertex_indices\nend_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  ASSERT_EQ(bytes.size(), header.size() + 21 * mesh.vertices_W.size() + 13 * mesh.triangles.size());
  const char* vertex = bytes.data() + header.size();
  float x;
  std::memcpy(&x, vertex, 4);
  EXPECT_EQ(x, mesh.vertices_W[0].x());
  EXPECT_EQ(vertex[12], 10);
  EXPECT_EQ(vertex[14], static_cast<char>(mesh.owner[0]));
  EXPECT_EQ(vertex[15], 1);  // 513, low byte first
  EXPECT_EQ(vertex[16], 2);
  EXPECT_EQ(vertex[17], static_cast<char>(mesh.owner[0]));
  std::filesystem::remove(file);
}

TEST(Mesh, UnwritablePlyIsNamed) {
  try {
    write_ply(
        {}, [](std::uint32_t) { return OwnerAppearance{}; }, "/nonexistent/map.ply");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/map.ply"), std::string::npos);
  }
}

}  // namespace
}  // namespace pocd::testing
