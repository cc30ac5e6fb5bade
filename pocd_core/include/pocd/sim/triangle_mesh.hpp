// A surface of triangles: shapes that boxes and cylinders cannot give, and shapes from files.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pocd {

/// Immutable once made; every member is thread-safe. Rays and distances are answered by Embree (Wald
/// et al., SIGGRAPH 2014), with one set of kernels on every x86 processor, so that the bits of a
/// picture do not depend on the machine. Triangles are seen from both sides; nothing need be closed.
class TriangleMesh {
 public:
  struct Hit {
    float t = 0.0f;           ///< ray parameter
    Eigen::Vector3f normal;   ///< unit, towards the ray's origin
  };

  /// Shifts the vertices [m] so that the middle of their bounding box is the origin. `triangles`
  /// index vertices. Throws InputError, beginning with `source`, for no triangle, an index that is
  /// out of range, a vertex that is not finite, or a box without extent along an axis.
  TriangleMesh(std::vector<Eigen::Vector3f> vertices, std::vector<Eigen::Vector3i> triangles,
               const std::string& source);
  ~TriangleMesh();
  TriangleMesh(const TriangleMesh&) = delete;
  TriangleMesh& operator=(const TriangleMesh&) = delete;

  const std::vector<Eigen::Vector3f>& vertices() const { return vertices_; }
  const std::vector<Eigen::Vector3i>& triangles() const { return triangles_; }
  /// Edges of the bounding box [m], each > 0.
  const Eigen::Vector3d& size_m() const { return size_m_; }

  /// Ray parameter of the first triangle in [t_near, t_far); t_far when there is none.
  float cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float t_near,
             float t_far = std::numeric_limits<float>::infinity()) const;
  /// The same with the normal of what is met.
  std::optional<Hit> cast_with_normal(const Eigen::Vector3f& origin,
                                      const Eigen::Vector3f& direction, float t_near,
                                      float t_far) const;
  /// Distance of a point to the nearest triangle [m], at most limit_m.
  double distance_m(const Eigen::Vector3d& point, double limit_m) const;

  /// `count` points spread evenly over the surface by area; the same ones every time.
  std::vector<Eigen::Vector3f> sample(std::size_t count) const;
  double area_m2() const;

 private:
  struct Tree;
  std::vector<Eigen::Vector3f> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  Eigen::Vector3d size_m_;
  std::unique_ptr<Tree> tree_;
};

/// Reads vertices and faces of a Wavefront OBJ file, z up, coordinates times `scale` in metres.
/// Faces with more than three corners must be convex. Groups, normals, texture coordinates, lines
/// and materials are not used. Throws InputError naming file, line and value for anything else.
std::shared_ptr<const TriangleMesh> load_obj(const std::filesystem::path& file, double scale = 1.0);

}  // namespace pocd
