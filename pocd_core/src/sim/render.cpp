#include "pocd/sim/render.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pocd/common/kernel.hpp"
#include "pocd/sim/triangle_mesh.hpp"
#include "shade.hpp"

namespace pocd {
namespace {

constexpr float kNear_m = 0.02f;

/// A part prepared for one view: ray origin in the part's frame P, ray direction as a linear
/// function of the pixel, and the screen rectangle outside of which no ray can meet it.
struct ViewPart {
  Shape shape;
  int object, part;
  float half[3];
  float origin[3];
  float dir0[3], dir_u[3], dir_v[3];  // direction_P(u, v) = dir0 + u dir_u + v dir_v
  int u0, u1, v0, v1;                 // pixels in [u0, u1) x [v0, v1)
  const TriangleMesh* mesh;           // of kMesh
};

/// Bounds the projection of the part's box, cut at the near plane. False when nothing is in front.
bool bound_on_screen(const Pose& T_C_P, const Eigen::Vector3d& half, const CameraModel& camera,
                     ViewPart& out) {
  Eigen::Vector3d corners[8];
  for (int i = 0; i < 8; ++i) {
    corners[i] = T_C_P * Eigen::Vector3d(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(),
                                         i & 4 ? half.z() : -half.z());
  }
  double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9;
  const auto add = [&](const Eigen::Vector3d& p_C) {
    const double u = camera.fx * p_C.x() / p_C.z() + camera.cx;
    const double v = camera.fy * p_C.y() / p_C.z() + camera.cy;
    low_u = std::min(low_u, u), high_u = std::max(high_u, u);
    low_v = std::min(low_v, v), high_v = std::max(high_v, v);
  };
  for (int i = 0; i < 8; ++i) {
    if (corners[i].z() >= kNear_m) add(corners[i]);
    for (int bit = 1; bit < 8; bit <<= 1) {
      const Eigen::Vector3d &a = corners[i], &b = corners[i ^ bit];
      if (a.z() >= kNear_m || b.z() < kNear_m) continue;
      add(a + (kNear_m - a.z()) / (b.z() - a.z()) * (b - a));
    }
  }
  const auto pixel = [](double x, int size) {
    return static_cast<int>(std::clamp(x, 0.0, static_cast<double>(size)));
  };
  out.u0 = pixel(std::floor(low_u) - 1.0, camera.width);
  out.u1 = pixel(std::ceil(high_u) + 2.0, camera.width);
  out.v0 = pixel(std::floor(low_v) - 1.0, camera.height);
  out.v1 = pixel(std::ceil(high_v) + 2.0, camera.height);
  return out.u0 < out.u1 && out.v0 < out.v1;
}

POCD_KERNEL void cast_box_row(const ViewPart& part, int v, float* depth_m, std::int32_t* part_id) {
  const float fv = static_cast<float>(v);
  const float ox = part.origin[0], oy = part.origin[1], oz = part.origin[2];
  const float hx = part.half[0], hy = part.half[1], hz = part.half[2];
  const float bx = part.dir0[0] + fv * part.dir_v[0], by = part.dir0[1] + fv * part.dir_v[1],
              bz = part.dir0[2] + fv * part.dir_v[2];
  const float ux = part.dir_u[0], uy = part.dir_u[1], uz = part.dir_u[2];
  const std::int32_t id = part.part;
  for (int u = part.u0; u < part.u1; ++u) {
    const float fu = static_cast<float>(u);
    const float ix = 1.0f / (bx + fu * ux), iy = 1.0f / (by + fu * uy), iz = 1.0f / (bz + fu * uz);
    const float ax = (-hx - ox) * ix, cx = (hx - ox) * ix;
    const float ay = (-hy - oy) * iy, cy = (hy - oy) * iy;
    const float az = (-hz - oz) * iz, cz = (hz - oz) * iz;
    const float enter = std::max(std::max(std::min(ax, cx), std::min(ay, cy)), std::min(az, cz));
    const float leave = std::min(std::min(std::max(ax, cx), std::max(ay, cy)), std::max(az, cz));
    const bool hit = (enter <= leave) & (enter >= kNear_m) & (enter < depth_m[u]);
    depth_m[u] = hit ? enter : depth_m[u];
    part_id[u] = hit ? id : part_id[u];
  }
}

POCD_KERNEL void cast_cylinder_row(const ViewPart& part, int v, float* depth_m,
                                   std::int32_t* part_id) {
  const float fv = static_cast<float>(v);
  const float ox = part.origin[0], oy = part.origin[1], oz = part.origin[2];
  const float radius = part.half[0], hz = part.half[2];
  const float c = ox * ox + oy * oy - radius * radius;
  for (int u = part.u0; u < part.u1; ++u) {
    const float fu = static_cast<float>(u);
    const float dx = part.dir0[0] + fv * part.dir_v[0] + fu * part.dir_u[0];
    const float dy = part.dir0[1] + fv * part.dir_v[1] + fu * part.dir_u[1];
    const float dz = part.dir0[2] + fv * part.dir_v[2] + fu * part.dir_u[2];
    const float a = dx * dx + dy * dy, b = ox * dx + oy * dy;
    const float discriminant = b * b - a * c;
    const float root = std::sqrt(std::max(discriminant, 0.0f));
    const float ia = 1.0f / a, iz = 1.0f / dz;
    const float az = (-hz - oz) * iz, cz = (hz - oz) * iz;
    const float enter = std::max((-b - root) * ia, std::min(az, cz));
    const float leave = std::min((-b + root) * ia, std::max(az, cz));
    const bool hit =
        (discriminant > 0.0f) & (enter <= leave) & (enter >= kNear_m) & (enter < depth_m[u]);
    depth_m[u] = hit ? enter : depth_m[u];
    part_id[u] = hit ? part.part : part_id[u];
  }
}

void cast_mesh_row(const ViewPart& part, int v, float* depth_m, std::int32_t* part_id) {
  const Eigen::Vector3f origin(part.origin), du(part.dir_u);
  const Eigen::Vector3f begin =
      Eigen::Vector3f(part.dir0) + static_cast<float>(v) * Eigen::Vector3f(part.dir_v);
  for (int u = part.u0; u < part.u1; ++u) {
    const float t =
        part.mesh->cast(origin, begin + static_cast<float>(u) * du, kNear_m, depth_m[u]);
    if (!(t < depth_m[u])) continue;
    depth_m[u] = t;
    part_id[u] = part.part;
  }
}

std::vector<ViewPart> prepare(const Scene& scene, const CameraModel& camera, const Pose& T_W_C,
                              std::vector<int>& object_of_part) {
  std::vector<ViewPart> parts;
  int running = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    for (const ScenePart& part : scene.objects[i].parts) {
      ViewPart view{};
      view.shape = part.shape;
      view.mesh = part.mesh.get();
      view.object = static_cast<int>(i);
      view.part = running++;
      object_of_part.push_back(view.object);
      Eigen::Vector3d half = 0.5 * part.size_m;
      if (part.shape == Shape::kCylinder) half.y() = half.x();
      const Pose T_P_C = (scene.objects[i].T_W_O * part.T_O_P).inverse() * T_W_C;
      if (!bound_on_screen(T_P_C.inverse(), half, camera, view)) continue;
      const Eigen::Matrix3d& R = T_P_C.linear();
      const Eigen::Vector3d du = R.col(0) / camera.fx, dv = R.col(1) / camera.fy;
      const Eigen::Vector3d d0 = R.col(2) - camera.cx * du - camera.cy * dv;
      for (int k = 0; k < 3; ++k) {
        view.half[k] = static_cast<float>(half[k]);
        view.origin[k] = static_cast<float>(T_P_C.translation()[k]);
        view.dir0[k] = static_cast<float>(d0[k]);
        view.dir_u[k] = static_cast<float>(du[k]);
        view.dir_v[k] = static_cast<float>(dv[k]);
      }
      parts.push_back(view);
    }
  }
  return parts;
}

}  // namespace

RenderedFrame render(const Scene& scene, const CameraModel& camera, const Pose& T_W_C,
                     bool with_color, ThreadPool* pool) {
  RenderedFrame out;
  out.depth_m.create(camera.height, camera.width, CV_32FC1);
  out.objects.create(camera.height, camera.width, CV_32SC1);
  out.parts.create(camera.height, camera.width, CV_32SC1);
  out.labels.create(camera.height, camera.width, CV_16UC1);
  if (with_color) out.color.create(camera.height, camera.width, CV_8UC3);

  std::vector<int> object_of_part;
  const std::vector<ViewPart> parts = prepare(scene, camera, T_W_C, object_of_part);
  const Shader shader(scene, camera, T_W_C);
  const auto rows = [&](std::size_t begin, std::size_t end) {
    for (int v = static_cast<int>(begin); v < static_cast<int>(end); ++v) {
      float* depth_m = out.depth_m.ptr<float>(v);
      std::int32_t* part_id = out.parts.ptr<std::int32_t>(v);
      std::fill_n(depth_m, camera.width, std::numeric_limits<float>::infinity());
      std::fill_n(part_id, camera.width, -1);
      for (const ViewPart& part : parts) {
        if (v < part.v0 || v >= part.v1) continue;
        switch (part.shape) {
          case Shape::kBox:
            cast_box_row(part, v, depth_m, part_id);
            break;
          case Shape::kCylinder:
            cast_cylinder_row(part, v, depth_m, part_id);
            break;
          case Shape::kMesh:
            cast_mesh_row(part, v, depth_m, part_id);
            break;
        }
      }
      std::int32_t* object_id = out.objects.ptr<std::int32_t>(v);
      std::uint16_t* label = out.labels.ptr<std::uint16_t>(v);
      for (int u = 0; u < camera.width; ++u) {
        object_id[u] = part_id[u] < 0 ? -1 : object_of_part[part_id[u]];
        label[u] = object_id[u] < 0 ? 0 : scene.objects[object_id[u]].class_id;
        if (object_id[u] < 0) depth_m[u] = 0.0f;
      }
      if (with_color) shader.shade_row(v, depth_m, part_id, out.color.ptr<cv::Vec3b>(v));
    }
  };
  if (pool != nullptr) {
    pool->parallel_for(static_cast<std::size_t>(camera.height), 16, rows);
  } else {
    rows(0, static_cast<std::size_t>(camera.height));
  }
  return out;
}

}  // namespace pocd
