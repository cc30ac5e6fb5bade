// A small room seen by a small camera: exact depth and labels of a few boxes before a wall, with
// white noise on demand, for the tests of segmentation, association and the pipeline.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "look_from.hpp"
#include "pocd/common/random.hpp"
#include "pocd/input/depth_noise.hpp"
#include "pocd/input/frame.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/segmentation/observations.hpp"
#include "pocd/sim/render.hpp"

namespace pocd::test {

constexpr ClassId kWallClass = 0, kFloorClass = 1, kFenceClass = 4, kFenceAlias = 5, kBoxClass = 7,
                  kCageClass = 9, kPersonClass = 13, kRobotClass = 3;

inline ClassMap room_classes() {
  ClassMap map;
  const auto add = [&](int id, const char* name, ClassRole role, int stationarity_class) {
    ClassInfo info;
    info.id = id;
    info.name = name;
    info.role = role;
    info.stationarity_class = stationarity_class;
    map.list.push_back(info);
  };
  add(kWallClass, "wall", ClassRole::kBackground, 1);
  add(kFloorClass, "floor", ClassRole::kGround, 1);
  add(kRobotClass, "robot", ClassRole::kIgnore, 0);
  add(kFenceClass, "fence", ClassRole::kObject, 1);
  add(kFenceAlias, "fence", ClassRole::kObject, 1);
  add(kBoxClass, "box", ClassRole::kObject, 0);
  add(kCageClass, "cage", ClassRole::kObject, 0);
  add(kPersonClass, "person", ClassRole::kDynamic, 0);
  return map;
}

/// Defaults of the product, with the room's classes, and its far wall within the depth limit.
inline PipelineConfig room_config() {
  PipelineConfig config;
  config.classes = room_classes();
  config.map.max_depth_m = 4.0;
  return config;
}

inline CameraModel room_camera() { return {320, 240, 260.0, 260.0, 159.5, 119.5}; }

/// A box that stands at height `z_m` with its middle at (x, y).
inline SceneObject solid(ClassId class_id, const Eigen::Vector2d& middle_W,
                         const Eigen::Vector3d& size_m, double yaw_rad = 0.0, double z_m = 0.0) {
  SceneObject object;
  object.class_id = class_id;
  object.T_W_O = upright_pose({middle_W.x(), middle_W.y(), z_m}, yaw_rad);
  ScenePart part;
  part.size_m = size_m;
  part.T_O_P.translation() = Eigen::Vector3d(0, 0, 0.5 * size_m.z());
  object.parts.push_back(part);
  return object;
}

/// Floor at z = 0, wall at y = 3.5 facing the camera, and the given things.
inline Scene room_with(std::vector<SceneObject> things) {
  Scene scene;
  scene.objects.push_back(solid(kFloorClass, {0, 2}, {12, 8, 0.2}, 0.0, -0.2));
  scene.objects.push_back(solid(kWallClass, {0, 3.6}, {12, 0.2, 3}));
  for (auto& thing : things) scene.objects.push_back(std::move(thing));
  return scene;
}

/// Exact frame number `sequence` of a 15 Hz camera.
inline Frame shoot(const Scene& scene, const Pose& T_W_C, std::uint64_t sequence = 0) {
  const CameraModel camera = room_camera();
  const RenderedFrame picture = render(scene, camera, T_W_C, false);
  Frame frame;
  frame.stamp_ns = 1'000'000'000 + static_cast<StampNs>(sequence) * 66'666'667;
  frame.sequence = sequence;
  frame.camera = camera;
  frame.T_W_C = T_W_C;
  frame.depth_m = picture.depth_m;
  frame.labels = picture.labels;
  return frame;
}

/// White noise of the model's sigma; the same for the same seed and frame number.
inline void add_noise(Frame& frame, const DepthNoise& noise, std::uint64_t seed) {
  Random random(seed * 1'000'003 + frame.sequence);
  for (int v = 0; v < frame.depth_m.rows; ++v) {
    float* line = frame.depth_m.ptr<float>(v);
    for (int u = 0; u < frame.depth_m.cols; ++u) {
      if (line[u] <= 0.0f) continue;
      line[u] += static_cast<float>(noise.sigma(line[u]) * random.normal());
    }
  }
}

/// Where the camera is in frame i of a drive: it sways sideways and turns a little.
inline Pose swaying_camera(std::uint64_t i) {
  const double phase = 2.0 * M_PI * static_cast<double>(i) / 40.0;
  return look_from({0.25 * std::sin(phase), 0.0, 1.0}, 0.06 * std::cos(phase));
}

/// The stages from frame to observations, with what they leave behind.
struct Segmented {
  OrganizedCloud cloud;
  PlaneSegmentation planes;
  Observations observations;
};

inline Segmented segment(const Frame& frame, const PipelineConfig& config, GroundModel& ground) {
  Segmented out;
  ThreadPool pool(1);
  organize(frame, config.segmentation.stride, config.map.max_depth_m, config.classes,
           ClassTable(config.classes), pool, out.cloud);
  segment_planes(out.cloud, config.segmentation, config.depth_noise, out.planes);
  vote_planes(out.planes, config.segmentation.majority_share, out.cloud);
  ground.update(out.planes, config.segmentation, config.depth_noise, out.cloud);
  extract_observations(config.segmentation, config.depth_noise, config.map.voxel_size_m, out.planes,
                       out.cloud, out.observations);
  return out;
}

inline Segmented segment(const Frame& frame, const PipelineConfig& config) {
  GroundModel ground;
  return segment(frame, config, ground);
}

/// Index of the grid pixel that shows this point, which must be in view.
inline std::size_t pixel_of(const OrganizedCloud& cloud, const Eigen::Vector3d& point_W) {
  const Eigen::Vector3d p_C = cloud.T_W_C.inverse() * point_W;
  const auto col = std::lround(cloud.camera.fx * p_C.x() / p_C.z() + cloud.camera.cx);
  const auto row = std::lround(cloud.camera.fy * p_C.y() / p_C.z() + cloud.camera.cy);
  if (p_C.z() <= 0 || col < 0 || col >= cloud.width || row < 0 || row >= cloud.height)
    throw std::out_of_range("pixel_of: the camera does not see the point");
  return static_cast<std::size_t>(row * cloud.width + col);
}

}  // namespace pocd::test
