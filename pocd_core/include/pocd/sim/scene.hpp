// The simulated world: solid boxes, upright cylinders and triangle meshes, grouped to objects.
// Depth seen by a camera is exact, so that tests and evaluation have a truth that no sampling
// blurs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pocd/common/enum_words.hpp"
#include "pocd/common/types.hpp"

namespace pocd {

class TriangleMesh;

enum class Shape { kBox, kCylinder, kMesh };
/// Those of a file without a mesh.
inline EnumWords<Shape> words_of(Shape) {
  return {{Shape::kBox, "box"}, {Shape::kCylinder, "cylinder"}};
}

/// How a surface is painted in the colour image; no effect on depth or labels.
enum class Texture { kPlain, kCardboard, kTarp, kConcrete, kWood };
inline EnumWords<Texture> words_of(Texture) {
  return {{Texture::kPlain, "plain"},
          {Texture::kCardboard, "cardboard"},
          {Texture::kTarp, "tarp"},
          {Texture::kConcrete, "concrete"},
          {Texture::kWood, "wood"}};
}

/// One solid. Its frame P has the origin at the centre of the solid.
/// kBox: edges size_m along x, y, z. kCylinder: axis along z, diameter size_m.x, height size_m.z.
/// kMesh: size_m is the mesh's bounding box, whose centre is the origin.
struct ScenePart {
  Shape shape = Shape::kBox;
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();
  Pose T_O_P = Pose::Identity();
  Eigen::Vector3d rgb = {150, 150, 150};  ///< each in [0, 255]
  Texture texture = Texture::kPlain;
  std::shared_ptr<const TriangleMesh> mesh = nullptr;  ///< of kMesh, and only there
};

/// Where an object that moves during a visit is at `time_s` after the start of the visit.
struct TrackPoint {
  double time_s = 0.0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

/// A named thing. Its frame O stands on the floor: origin at the middle of the base, z up unless
/// the thing leans.
struct SceneObject {
  std::string name;
  ClassId class_id = 0;
  int stationarity_class = 0;  ///< s: 0 movable, 1 static
  /// Part of the building (floor, walls): never listed as an object in the truth.
  bool fixture = false;
  Pose T_W_O = Pose::Identity();
  std::vector<ScenePart> parts;
  /// Moves through these points, in order of time, keeping its height; rests before the first and
  /// after the last. Empty: rests.
  std::vector<TrackPoint> track;
  /// Only there while its track lasts (a person passing): never listed as an object in the truth.
  bool transient = false;
};

/// The world at one instant. Objects do not move; tracks are already applied.
struct Scene {
  std::vector<SceneObject> objects;
};

/// Smallest box around the object's parts with the object's heading (exact for boxes, upright
/// cylinders and meshes).
OrientedBox bounding_box(const SceneObject& object);

/// Pose in the track at time_s; T_W_O where there is no track.
Pose pose_at(const SceneObject& object, double time_s);

/// False for a transient object outside its track.
bool exists_at(const SceneObject& object, double time_s);

/// Rigid pose from a position and a heading [rad] about +z.
Pose upright_pose(const Eigen::Vector3d& position_m, double yaw_rad);

/// True when the two upright boxes share more than `tolerance_m` along every separating axis.
bool boxes_overlap(const OrientedBox& a, const OrientedBox& b, double tolerance_m = 1e-6);

}  // namespace pocd
