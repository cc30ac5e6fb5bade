#include "pocd/sim/triangle_mesh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>

#include "../datasets/scratch_folder.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"
#include "pocd/sim/render.hpp"
#include "pocd/sim/scenario.hpp"

namespace pocd {
namespace {

/// A cuboid of quads as a file has it, its lower corner at `low`.
std::string cuboid_obj(const Eigen::Vector3d& low, const Eigen::Vector3d& size) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d p =
        low + Eigen::Vector3d(i & 1 ? size.x() : 0, i & 2 ? size.y() : 0, i & 4 ? size.z() : 0);
    text += "v " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " +
            std::to_string(p.z()) + "\n";
  }
  return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

std::shared_ptr<const TriangleMesh> cuboid(const Eigen::Vector3d& size) {
  const ScratchFolder folder;
  folder.write("c.obj", cuboid_obj({0.3, -2.0, 5.0}, size));
  return load_obj(folder / "c.obj");
}

/// The text of the error that reading gives, "" for none.
std::string error_of(const std::string& text) {
  const ScratchFolder folder;
  folder.write("m.obj", text);
  try {
    load_obj(folder / "m.obj");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ObjFile, ReadsWhatProgramsWrite) {
  const ScratchFolder folder;
  folder.write("m.obj",
               "# text\r\nmtllib x.mtl\r\no thing\r\nv 1 1 1 0.5 0.5 0.5\r\nv 3 1 1\r\nvn 0 0 1\r\n"
               "v 3 2 1\r\nvt 0 0\r\nv 1 2 2\r\ng a\r\nusemtl y\r\ns off\r\n"
               "f 1/1/1 2//1 3/1 4\r\nf -4 -3 -2\r\n\r\n");
  const auto mesh = load_obj(folder / "m.obj", 2.0);
  ASSERT_EQ(mesh->triangles().size(), 3u);
  EXPECT_EQ(mesh->triangles()[1], Eigen::Vector3i(0, 2, 3));
  EXPECT_EQ(mesh->triangles()[2], Eigen::Vector3i(0, 1, 2));
  EXPECT_NEAR((mesh->size_m() - Eigen::Vector3d(4, 2, 2)).norm(), 0.0, 1e-6);
  // The middle of the box is the origin.
  EXPECT_NEAR((mesh->vertices()[0] - Eigen::Vector3f(-2, -1, -1)).norm(), 0.0, 1e-6);
}

TEST(ObjFile, OneDefectOneLine) {
  const std::string good = "v 0 0 0\nv 1 0 0\nv 0 1 1\n";
  const std::pair<std::string, std::string> cases[] = {
      {"", "no triangles"},
      {good, "no triangles"},
      {good + "f 1 2\n", "m.obj:4: a face needs 3"},
      {good + "f 1 2 4\n", "m.obj:4: there is no vertex '4'"},
      {good + "f 1 2 0\n", "'0'"},
      {good + "f 1 2 -4\n", "'-4'"},
      {good + "f 1 2 x\n", "'x' is no vertex"},
      {good + "f 1 2 3/1x 3.5\n", "'3.5'"},
      {"v 0 0\n" + good, "m.obj:1: a vertex needs 3"},
      {"v 0 0 1e\n" + good, "'1e' is no number"},
      {"v 0 0 nan\nv 1 0 0\nv 0 1 1\nf 1 2 3\n", "'nan' is not finite"},
      {"v 0 0 1e39\nv 1 0 0\nv 0 1 1\nf 1 2 3\n", "'1e39' is not finite"},
      {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no extent"},
      {good + "curv 1 2\n", "m.obj:4: unknown keyword 'curv'"},
      {std::string("\0\1\2PNG", 6), "m.obj:1: unknown keyword"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string error = error_of(text);
    EXPECT_NE(error.find(expected), std::string::npos) << text << " -> " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_THROW(load_obj("/nowhere/m.obj"), InputError);
  EXPECT_THROW(load_obj("/tmp"), InputError);
}

Scene scene_of(const ScenePart& part, const Pose& T_W_O) {
  Scene scene;
  scene.objects.resize(1);
  scene.objects[0].class_id = 7;
  scene.objects[0].T_W_O = T_W_O;
  scene.objects[0].parts = {part};
  return scene;
}

/// Exact by two independent ways: slabs of the analytic box, triangles of the mesh.
TEST(TriangleMesh, ACuboidLooksLikeTheAnalyticBox) {
  Random random(17);
  CameraModel camera = torwic_camera();
  camera.width = 160, camera.height = 90;
  camera.fx /= 4, camera.fy /= 4, camera.cx /= 4, camera.cy /= 4;
  int hits = 0;
  for (int trial = 0; trial < 30; ++trial) {
    ScenePart box;
    box.size_m =
        Eigen::Vector3d(random.uniform(0.1, 2), random.uniform(0.1, 2), random.uniform(0.1, 2));
    ScenePart mesh = box;
    mesh.shape = Shape::kMesh;
    mesh.mesh = cuboid(box.size_m);
    const Pose T_W_O =
        upright_pose({random.uniform(-1, 1), random.uniform(-1, 1), 4.0}, random.uniform(-3, 3)) *
        Eigen::AngleAxisd(random.uniform(-1, 1), Eigen::Vector3d::UnitX());
    const RenderedFrame a = render(scene_of(box, T_W_O), camera, Pose::Identity(), true);
    const RenderedFrame b = render(scene_of(mesh, T_W_O), camera, Pose::Identity(), true);
    int differ = 0;
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const float za = a.depth_m.at<float>(v, u), zb = b.depth_m.at<float>(v, u);
        hits += za > 0;
        // A ray through an edge may meet either side.
        if ((za > 0) != (zb > 0) || std::abs(za - zb) > 1e-4f) ++differ;
        EXPECT_EQ(zb > 0, b.labels.at<std::uint16_t>(v, u) == 7);
      }
    }
    EXPECT_LE(differ, 14) << trial;  // 0.1 % of the pixels
    const OrientedBox box_a = bounding_box(scene_of(box, T_W_O).objects[0]);
    const OrientedBox box_b = bounding_box(scene_of(mesh, T_W_O).objects[0]);
    EXPECT_NEAR((box_a.size_m - box_b.size_m).norm(), 0.0, 1e-5);
    EXPECT_NEAR((box_a.pose.position_W - box_b.pose.position_W).norm(), 0.0, 1e-5);
  }
  EXPECT_GT(hits, 10000);
}

TEST(TriangleMesh, OneLooksIntoAnOpenBox) {
  // A cuboid without its top, 1 m high: a camera above sees the floor inside, and the shading of a
  // picture has a normal there.
  const ScratchFolder folder;
  std::string text = cuboid_obj({0, 0, 0}, {1, 1, 1});
  text.erase(text.find("f 5 6 8 7\n"), 10);
  folder.write("open.obj", text);
  ScenePart part;
  part.shape = Shape::kMesh;
  part.mesh = load_obj(folder / "open.obj");
  part.size_m = part.mesh->size_m();
  Pose above = Pose::Identity();
  above.translation().z() = 3.0;
  above.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const RenderedFrame seen =
      render(scene_of(part, Pose::Identity()), {64, 64, 64, 64, 32, 32}, above, true);
  EXPECT_NEAR(seen.depth_m.at<float>(32, 32), 3.5, 1e-5);
  EXPECT_GT(seen.color.at<cv::Vec3b>(32, 32)[0], 50);
  ThreadPool pool(4);
  const RenderedFrame again =
      render(scene_of(part, Pose::Identity()), {64, 64, 64, 64, 32, 32}, above, true, &pool);
  EXPECT_EQ(std::memcmp(seen.depth_m.data, again.depth_m.data, seen.depth_m.total() * 4), 0);
  EXPECT_EQ(std::memcmp(seen.color.data, again.color.data, seen.color.total() * 3), 0);
}

TEST(TriangleMesh, DistanceIsThatToTheNearestTriangle) {
  Random random(5);
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3i> triangles;
  for (int i = 0; i < 60; ++i) {
    vertices.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (i % 3 == 2) triangles.emplace_back(i - 2, i - 1, i);
  }
  const TriangleMesh mesh(vertices, triangles, "test");
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d p(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
    // A fine lattice over each triangle: never nearer than the truth, farther by at most its step.
    double lattice_m = 1e9;
    for (const Eigen::Vector3i& t : mesh.triangles()) {
      const Eigen::Vector3f a = mesh.vertices()[t.x()], b = mesh.vertices()[t.y()],
                            c = mesh.vertices()[t.z()];
      for (int i = 0; i <= 60; ++i) {
        for (int k = 0; i + k <= 60; ++k) {
          const Eigen::Vector3f q =
              a + static_cast<float>(i) / 60.0f * (b - a) + static_cast<float>(k) / 60.0f * (c - a);
          lattice_m = std::min(lattice_m, (q.cast<double>() - p).norm());
        }
      }
    }
    const double distance_m = mesh.distance_m(p, 10.0);
    EXPECT_LE(distance_m, lattice_m + 1e-6);
    EXPECT_GE(distance_m, lattice_m - 0.06);  // edges are below 3.5 m, so steps below 0.06 m
    EXPECT_EQ(mesh.distance_m(p, 0.5 * distance_m), 0.5 * distance_m);
  }
}

TEST(TriangleMesh, SamplesLieOnTheSurfaceInProportionToItsArea) {
  const auto mesh = cuboid({2.0, 1.0, 0.5});
  EXPECT_NEAR(mesh->area_m2(), 2 * (2.0 + 1.0 + 0.5), 1e-5);
  const auto points = mesh->sample(700);
  ASSERT_EQ(points.size(), 700u);
  int top = 0;
  for (const Eigen::Vector3f& point : points) {
    EXPECT_LT(mesh->distance_m(point.cast<double>(), 1.0), 1e-5);
    top += point.z() > 0.25f - 1e-5f;
  }
  EXPECT_NEAR(top, 700 * 2 / 7, 3);  // of each triangle, rounding of at most one
}

}  // namespace
}  // namespace pocd
