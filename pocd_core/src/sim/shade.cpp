#include "shade.hpp"

#include <algorithm>
#include <cmath>

#include "hash_noise.hpp"
#include "pocd/sim/triangle_mesh.hpp"

namespace pocd {
namespace {

const Eigen::Vector3f kToLight_W = Eigen::Vector3f(0.35f, 0.25f, 0.9f).normalized();
constexpr float kAmbient = 0.72f;

/// 0 on a line of the given spacing, 1 away from it.
float away_from_line(float x, float spacing, float width) {
  const float offset = x - spacing * std::round(x / spacing);
  return std::abs(offset) < width ? 0.0f : 1.0f;
}

float speckle(const Eigen::Vector3f& p, float cell, float strength) {
  const auto index = [&](float x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / cell)));
  };
  // One mixing step for the whole cell: this runs once per pixel.
  const std::uint64_t key =
      index(p.x()) * 73856093u ^ index(p.y()) * 19349663u ^ index(p.z()) * 83492791u;
  return 1.0f + strength * (static_cast<float>(unit_of(Random(key).next())) - 0.5f);
}

/// Factor on the base colour at point p of the part (part frame, metres).
float texture_factor(Texture texture, const Eigen::Vector3f& p_P, const Eigen::Vector3f& half,
                     const Eigen::Vector3f& normal_P) {
  switch (texture) {
    case Texture::kPlain:
      return 1.0f;
    case Texture::kCardboard: {
      // Cartons of half a metre, seams dark, a lighter strip of tape at mid height.
      const float along = std::abs(normal_P.x()) > 0.5f ? p_P.y() + half.y() : p_P.x() + half.x();
      const float up = p_P.z() + half.z();
      const float seam = away_from_line(along, 0.5f, 0.008f) * away_from_line(up, 0.5f, 0.008f);
      const float tape = 1.0f - away_from_line(up - 0.25f, 0.5f, 0.025f);
      return (0.72f + 0.28f * seam + 0.1f * tape) * speckle(p_P, 0.04f, 0.1f);
    }
    case Texture::kTarp: {
      const float along = std::abs(normal_P.x()) > 0.5f ? p_P.y() : p_P.x();
      return 0.9f + 0.1f * std::sin(along * 12.0f + 0.7f * std::sin(p_P.z() * 2.0f));
    }
    case Texture::kConcrete: {
      const float joint =
          away_from_line(p_P.x(), 2.0f, 0.01f) * away_from_line(p_P.y(), 2.0f, 0.01f);
      return (0.8f + 0.2f * joint) * speckle(p_P, 0.07f, 0.08f);
    }
    case Texture::kWood:
      return 0.92f + 0.08f * std::sin(p_P.x() * 60.0f) * std::sin(p_P.y() * 9.0f);
  }
  return 1.0f;
}

Eigen::Vector3f normal_of_hit(const ScenePart& part, const Eigen::Vector3f& p_P,
                              const Eigen::Vector3f& half) {
  if (part.shape == Shape::kCylinder) {
    if (std::abs(p_P.z()) > half.z() - 1e-3f) return {0, 0, p_P.z() > 0 ? 1.0f : -1.0f};
    return Eigen::Vector3f(p_P.x(), p_P.y(), 0).normalized();
  }
  int axis = 0;
  const Eigen::Vector3f depth_inside = half - p_P.cwiseAbs();
  depth_inside.minCoeff(&axis);
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  normal[axis] = p_P[axis] > 0 ? 1.0f : -1.0f;
  return normal;
}

/// `p_P` was met by a ray from the camera: the same ray says which triangle it was.
Eigen::Vector3f normal_of_mesh(const TriangleMesh& mesh, const Eigen::Vector3f& p_P,
                               const Eigen::Vector3f& camera_P) {
  const Eigen::Vector3f ray = p_P - camera_P;
  const auto hit = mesh.cast_with_normal(camera_P, ray, 0.0f, 1.01f);
  return hit ? hit->normal : Eigen::Vector3f(-ray.normalized());
}

}  // namespace

Shader::Shader(const Scene& scene, const CameraModel& camera, const Pose& T_W_C) : camera_(camera) {
  for (const SceneObject& object : scene.objects) {
    for (const ScenePart& part : object.parts) {
      const Pose T_W_P = object.T_W_O * part.T_O_P;
      const Pose T_P_C = T_W_P.inverse() * T_W_C;
      parts_.push_back({&part, T_W_P.linear().cast<float>(), T_P_C.linear().cast<float>(),
                        T_P_C.translation().cast<float>()});
    }
  }
}

void Shader::shade_row(int v, const float* depth_m, const std::int32_t* part_id,
                       cv::Vec3b* bgr) const {
  for (int u = 0; u < camera_.width; ++u) {
    if (part_id[u] < 0) {
      bgr[u] = cv::Vec3b(46, 42, 40);
      continue;
    }
    const PaintedPart& painted = parts_[part_id[u]];
    const Eigen::Vector3f p_C = camera_.back_project(u, v, depth_m[u]).cast<float>();
    const Eigen::Vector3f p_P = painted.R_P_C * p_C + painted.camera_P;
    const Eigen::Vector3f half = 0.5f * painted.part->size_m.cast<float>();
    const Eigen::Vector3f normal_P = painted.part->shape == Shape::kMesh
                                         ? normal_of_mesh(*painted.part->mesh, p_P, painted.camera_P)
                                         : normal_of_hit(*painted.part, p_P, half);
    const float lambert = std::max(0.0f, (painted.R_W_P * normal_P).dot(kToLight_W));
    // Light falls off a little with distance, which gives the picture depth.
    const float fog = 1.15f / (1.0f + 0.03f * depth_m[u]);
    const float light = (kAmbient + (1.0f - kAmbient) * lambert) * fog *
                        texture_factor(painted.part->texture, p_P, half, normal_P);
    for (int k = 0; k < 3; ++k) {
      const float value = light * static_cast<float>(painted.part->rgb[2 - k]);
      bgr[u][k] = static_cast<std::uint8_t>(std::clamp(value, 0.0f, 255.0f));
    }
  }
}

}  // namespace pocd
