#include "pocd/sim/truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "pocd/common/check.hpp"
#include "pocd/sim/render.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {
namespace {

constexpr double kEndOfVisit = std::numeric_limits<double>::infinity();

const TruthObject* find(const std::vector<TruthObject>& objects, const std::string& name) {
  for (const TruthObject& object : objects) {
    if (object.name == name) return &object;
  }
  return nullptr;
}

bool same_thing(const TruthObject& a, const TruthObject& b) {
  return a.class_id == b.class_id && (a.box.size_m - b.box.size_m).norm() < 1e-6;
}

bool same_place(const OrientedBox& a, const OrientedBox& b) {
  const double turn = std::remainder(a.pose.yaw_rad - b.pose.yaw_rad, 2.0 * M_PI);
  return (a.pose.position_W - b.pose.position_W).norm() <= 1e-3 &&
         std::abs(turn) <= 0.1 * M_PI / 180.0;
}

/// Voxel coordinates packed to sort by z, y, x; each axis within +-2^20 voxels.
std::uint64_t pack(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::int64_t kBias = 1 << 20;
  POCD_CHECK(std::abs(x) < kBias && std::abs(y) < kBias && std::abs(z) < kBias);
  return (static_cast<std::uint64_t>(z + kBias) << 42) |
         (static_cast<std::uint64_t>(y + kBias) << 21) | static_cast<std::uint64_t>(x + kBias);
}

SurfaceVoxel unpack(std::uint64_t key, std::int32_t object) {
  const auto axis = [&](int shift) {
    return static_cast<std::int32_t>((key >> shift) & 0x1FFFFF) - (1 << 20);
  };
  return {axis(0), axis(21), axis(42), object};
}

/// The camera scaled so that two neighbouring rays are at most half a voxel apart at max depth.
CameraModel sampling_camera(const CameraModel& camera, const VisibleSurfaceOptions& options) {
  const double focal = 2.0 * options.max_depth_m / options.voxel_size_m;
  const double scale = std::min(1.0, focal / std::min(camera.fx, camera.fy));
  CameraModel out = camera;
  out.width = static_cast<int>(std::ceil(camera.width * scale));
  out.height = static_cast<int>(std::ceil(camera.height * scale));
  const double sx = static_cast<double>(out.width) / camera.width;
  const double sy = static_cast<double>(out.height) / camera.height;
  out.fx = camera.fx * sx, out.fy = camera.fy * sy;
  out.cx = (camera.cx + 0.5) * sx - 0.5, out.cy = (camera.cy + 0.5) * sy - 0.5;
  return out;
}

}  // namespace

const char* to_string(ChangeKind kind) {
  switch (kind) {
    case ChangeKind::kAdded:
      return "ADDED";
    case ChangeKind::kRemoved:
      return "REMOVED";
    case ChangeKind::kMoved:
      return "MOVED";
  }
  return "";
}

std::vector<TruthObject> objects_after(const Scenario& scenario, std::size_t visit) {
  std::vector<TruthObject> out;
  for (const SceneObject& object : scene_at(scenario, visit, kEndOfVisit).objects) {
    if (object.fixture) continue;
    out.push_back({object.name, object.class_id, object.stationarity_class, bounding_box(object)});
  }
  return out;
}

std::vector<TruthChange> changes_of(const Scenario& scenario, std::size_t visit) {
  POCD_CHECK(visit >= 1);
  const std::vector<TruthObject> before = objects_after(scenario, visit - 1);
  const std::vector<TruthObject> after = objects_after(scenario, visit);
  std::vector<TruthChange> out;
  for (const TruthObject& old : before) {
    const TruthObject* now = find(after, old.name);
    if (now == nullptr || !same_thing(old, *now)) {
      out.push_back({ChangeKind::kRemoved, old.name, old.class_id, old.box, std::nullopt});
    } else if (!same_place(old.box, now->box)) {
      out.push_back({ChangeKind::kMoved, old.name, old.class_id, old.box, now->box});
    }
  }
  for (const TruthObject& now : after) {
    const TruthObject* old = find(before, now.name);
    if (old == nullptr || !same_thing(*old, now)) {
      out.push_back({ChangeKind::kAdded, now.name, now.class_id, std::nullopt, now.box});
    }
  }
  return out;
}

std::vector<SurfaceVoxel> visible_surface(const Scenario& scenario, std::size_t visit,
                                          const VisibleSurfaceOptions& options, ThreadPool* pool) {
  POCD_CHECK(options.voxel_size_m > 0.0 && options.frame_stride >= 1);
  const CameraModel camera = sampling_camera(scenario.camera, options);
  const SimSchedule schedule(scenario);
  const Scene final_scene = scene_at(scenario, visit, kEndOfVisit);
  std::unordered_map<std::string, std::int32_t> final_index;
  for (std::size_t i = 0; i < final_scene.objects.size(); ++i) {
    final_index[final_scene.objects[i].name] = static_cast<std::int32_t>(i);
  }
  std::unordered_map<std::string, bool> moves;
  for (const SceneObject& object : scenario.visits.at(visit).objects) {
    if (!object.track.empty()) moves[object.name] = true;
  }
  std::unordered_map<std::uint64_t, std::int32_t> voxels;  // order does not matter: sorted below
  for (std::size_t frame = 0; frame < schedule.frames().size(); ++frame) {
    const SimFrameTime& when = schedule.frames()[frame];
    if (when.visit != visit || when.robot_frame % options.frame_stride != 0) continue;
    const Scene scene = scene_at(scenario, visit, when.visit_time_s);
    const Pose T_W_C = schedule.camera_at(when);
    const RenderedFrame seen = render(scene, camera, T_W_C, false, pool);
    std::vector<std::int32_t> index(scene.objects.size(), -1);
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      const SceneObject& object = scene.objects[i];
      if (moves.count(object.name) || (object.fixture && !options.include_fixtures)) continue;
      index[i] = final_index.at(object.name);
    }
    for (int v = 0; v < camera.height; ++v) {
      const float* z = seen.depth_m.ptr<float>(v);
      const std::int32_t* object = seen.objects.ptr<std::int32_t>(v);
      for (int u = 0; u < camera.width; ++u) {
        if (object[u] < 0 || z[u] > options.max_depth_m || index[object[u]] < 0) continue;
        const Eigen::Vector3d p = T_W_C * camera.back_project(u, v, z[u]) / options.voxel_size_m;
        const auto cell = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
        const std::uint64_t key = pack(cell(p.x()), cell(p.y()), cell(p.z()));
        const auto [place, fresh] = voxels.emplace(key, index[object[u]]);
        if (!fresh) place->second = std::min(place->second, index[object[u]]);
      }
    }
  }
  std::vector<std::pair<std::uint64_t, std::int32_t>> sorted(voxels.begin(), voxels.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<SurfaceVoxel> out;
  out.reserve(sorted.size());
  for (const auto& [key, object] : sorted) out.push_back(unpack(key, object));
  return out;
}

}  // namespace pocd
