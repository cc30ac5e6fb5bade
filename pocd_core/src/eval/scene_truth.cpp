#include "pocd/eval/scene_truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "pocd/common/check.hpp"
#include "pocd/sim/render.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "pocd/sim/triangle_mesh.hpp"

namespace pocd {
namespace {

constexpr int kLeastSamples = 10;
// In voxels of the map.
constexpr double kSampleSpacing = 2.0;
constexpr double kClearDepth = 1.0;  // between a sample and a measured depth
constexpr double kSeenMargin = 2.0;

struct Sample {
  Eigen::Vector3d point_W;
  Eigen::Vector3d normal_W;  ///< zero: seen from anywhere
  std::optional<std::size_t> first_seen;
};

/// Sides and top of a box.
std::vector<Sample> sample_box(const OrientedBox& box, double spacing_m) {
  std::vector<Sample> samples;
  const Pose T_W_B = upright_pose(box.pose.position_W, box.pose.yaw_rad);
  const Eigen::Vector3d half = box.size_m / 2.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      if (axis == 2 && side < 0.0) continue;
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      const int na = std::max(1, static_cast<int>(std::lround(box.size_m[a] / spacing_m)));
      const int nb = std::max(1, static_cast<int>(std::lround(box.size_m[b] / spacing_m)));
      for (int i = 0; i < na; ++i) {
        for (int j = 0; j < nb; ++j) {
          Eigen::Vector3d p, n = Eigen::Vector3d::Zero();
          p[axis] = side * half[axis], n[axis] = side;
          p[a] = -half[a] + box.size_m[a] * (i + 0.5) / na;
          p[b] = -half[b] + box.size_m[b] * (j + 0.5) / nb;
          samples.push_back({T_W_B * p, T_W_B.linear() * n, std::nullopt});
        }
      }
    }
  }
  return samples;
}

/// The surface of an object that has a mesh, else its box: a mesh may fill little of its box.
std::vector<Sample> sample_object(const SceneObject& object, const OrientedBox& box,
                                  double spacing_m) {
  std::vector<Sample> samples;
  bool has_mesh = false;
  for (const ScenePart& part : object.parts) {
    const Pose T_W_P = object.T_W_O * part.T_O_P;
    if (part.shape == Shape::kMesh) {
      has_mesh = true;
      const auto count = static_cast<std::size_t>(
          std::ceil(part.mesh->area_m2() / (spacing_m * spacing_m)));
      for (const Eigen::Vector3f& point : part.mesh->sample(count)) {
        samples.push_back({T_W_P * point.cast<double>(), Eigen::Vector3d::Zero(), std::nullopt});
      }
    } else {
      SceneObject alone;
      alone.T_W_O = T_W_P;
      alone.parts = {part};
      alone.parts[0].T_O_P = Pose::Identity();
      for (const Sample& sample : sample_box(bounding_box(alone), spacing_m)) {
        samples.push_back(sample);
      }
    }
  }
  return has_mesh ? samples : sample_box(box, spacing_m);
}

/// As it stands at the end of a visit.
const SceneObject& object_named(const Scene& scene, const std::string& name) {
  const auto found = std::find_if(scene.objects.begin(), scene.objects.end(),
                                  [&](const SceneObject& object) { return object.name == name; });
  POCD_CHECK(found != scene.objects.end());
  return *found;
}

enum class Look { kHit, kThrough };

void look(const Frame& frame, std::size_t number, const SceneTruthOptions& options, Look what,
          std::vector<Sample>& samples) {
  const Pose T_C_W = frame.T_W_C.inverse();
  const double clear_m = kClearDepth * options.map_voxel_m;
  for (Sample& sample : samples) {
    if (sample.first_seen) continue;
    if (!sample.normal_W.isZero() &&
        (frame.T_W_C.translation() - sample.point_W).dot(sample.normal_W) <= 0.0)
      continue;
    const Eigen::Vector3d p_C = T_C_W * sample.point_W;
    if (p_C.z() < 0.05 || p_C.z() > options.max_depth_m) continue;
    const double u = p_C.x() / p_C.z() * frame.camera.fx + frame.camera.cx + 0.5;
    const double v = p_C.y() / p_C.z() * frame.camera.fy + frame.camera.cy + 0.5;
    if (u < 0 || v < 0 || u >= frame.camera.width || v >= frame.camera.height) continue;
    const float depth = frame.depth_m.at<float>(static_cast<int>(v), static_cast<int>(u));
    const bool through = depth == 0.0f || depth > p_C.z() + clear_m;
    const bool hit = !through && depth > p_C.z() - clear_m;
    if (what == Look::kHit ? hit : through) sample.first_seen = number;
  }
}

/// Frame by which half of the samples that are seen at all have been seen.
std::optional<std::size_t> half_seen(const std::vector<Sample>& samples) {
  std::vector<std::size_t> frames;
  for (const Sample& sample : samples) {
    if (sample.first_seen) frames.push_back(*sample.first_seen);
  }
  if (frames.size() < kLeastSamples) return std::nullopt;
  std::sort(frames.begin(), frames.end());
  return frames[(frames.size() - 1) / 2];
}

/// Samples of the old and of the new place of a change.
struct Places {
  std::vector<Sample> before, after;
};

/// A change that nobody could see in its visit is one of the next visit, unless the object changes
/// again there.
void carry_over(std::size_t next_visit, std::vector<SeenChange>& changes,
                std::vector<Places>& places) {
  for (std::size_t c = 0; c < changes.size(); ++c) {
    if (changes[c].visit + 1 != next_visit || half_seen(places[c].before) ||
        half_seen(places[c].after) ||
        std::any_of(changes.begin(), changes.end(), [&](const SeenChange& other) {
          return other.visit == next_visit && other.change.name == changes[c].change.name;
        })) {
      continue;
    }
    changes[c].visit = next_visit;
    for (auto* samples : {&places[c].before, &places[c].after})
      for (Sample& sample : *samples) sample.first_seen.reset();
  }
}

double part_distance(const ScenePart& part, const Eigen::Vector3d& p_P, double limit_m) {
  if (part.shape == Shape::kMesh) return part.mesh->distance_m(p_P, limit_m);
  const Eigen::Vector3d half = part.size_m / 2.0;
  if (part.shape == Shape::kBox) {
    const Eigen::Vector3d q = p_P.cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  }
  const double dr = std::hypot(p_P.x(), p_P.y()) - half.x(), dz = std::abs(p_P.z()) - half.z();
  return std::hypot(std::max(dr, 0.0), std::max(dz, 0.0)) + std::min(std::max(dr, dz), 0.0);
}

CameraModel reduced(const CameraModel& camera, double scale) {
  CameraModel out = camera;
  out.width = static_cast<int>(camera.width * scale),
  out.height = static_cast<int>(camera.height * scale);
  out.fx = camera.fx * scale, out.fy = camera.fy * scale;
  out.cx = (camera.cx + 0.5) * scale - 0.5, out.cy = (camera.cy + 0.5) * scale - 0.5;
  return out;
}

}  // namespace

std::optional<std::size_t> SeenChange::clear_frame() const {
  if (old_place_frame && new_place_frame) return std::max(*old_place_frame, *new_place_frame);
  return old_place_frame ? old_place_frame : new_place_frame;
}

double surface_distance(const Scene& scene, const Eigen::Vector3d& point_W, double limit_m) {
  double best = limit_m;
  for (const SceneObject& object : scene.objects) {
    for (const ScenePart& part : object.parts) {
      const Pose T_W_P = object.T_W_O * part.T_O_P;
      const Eigen::Vector3d offset = point_W - T_W_P.translation();
      const double reach = best + part.size_m.norm() / 2.0;
      if (offset.squaredNorm() > reach * reach) continue;
      best = std::min(best, std::abs(part_distance(part, T_W_P.linear().transpose() * offset, best)));
    }
  }
  return best;
}

SceneTruth scene_truth(const Scenario& scenario, const SceneTruthOptions& options,
                       ThreadPool* pool) {
  const std::size_t last = scenario.visits.size() - 1;
  SceneTruth truth{
      {},
      ObservedRegion(options.map_voxel_m, options.max_depth_m, kSeenMargin * options.map_voxel_m),
      {},
      {},
      {},
      2.0 * options.map_voxel_m};
  const auto final_scene =
      std::make_shared<Scene>(scene_at(scenario, last, std::numeric_limits<double>::infinity()));
  truth.surface.distance_m = [final_scene](const Eigen::Vector3d& p) {
    return surface_distance(*final_scene, p, 1.0);
  };
  VisibleSurfaceOptions visible;
  visible.voxel_size_m = options.map_voxel_m;
  visible.max_depth_m = options.max_depth_m;
  visible.frame_stride = options.frame_stride;
  visible.include_fixtures = false;
  for (const SurfaceVoxel& voxel : visible_surface(scenario, last, visible, pool)) {
    truth.surface.visible.push_back({voxel.x, voxel.y, voxel.z});
  }

  std::vector<Places> places;
  const double spacing_m = kSampleSpacing * options.map_voxel_m;
  for (std::size_t visit = 0; visit <= last; ++visit) {
    truth.objects.push_back(objects_after(scenario, visit));
    if (visit == 0) continue;
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    const Scene before = scene_at(scenario, visit - 1, kEnd);
    const Scene after = scene_at(scenario, visit, kEnd);
    const auto samples = [&](const Scene& scene, const std::string& name,
                             const std::optional<OrientedBox>& box) {
      return box ? sample_object(object_named(scene, name), *box, spacing_m)
                 : std::vector<Sample>();
    };
    for (const TruthChange& change : changes_of(scenario, visit)) {
      truth.changes.push_back({change, visit, std::nullopt, std::nullopt});
      places.push_back({samples(before, change.name, change.before),
                        samples(after, change.name, change.after)});
    }
  }

  const SimSchedule schedule(scenario);
  // A quarter of the resolution: samples are two voxels apart; at 5 cm and 3 m 4 pixels are 2.6 cm.
  const CameraModel coarse = reduced(scenario.camera, 0.25), half = reduced(scenario.camera, 0.5);
  for (std::size_t i = 0; i < schedule.frames().size(); ++i) {
    const SimFrameTime& when = schedule.frames()[i];
    if (truth.visit_begin.size() == when.visit) {
      truth.visit_begin.push_back(i);
      carry_over(when.visit, truth.changes, places);
    }
    if (when.visit == 0) continue;
    Frame frame;
    frame.T_W_C = schedule.camera_at(when);
    const Scene scene = scene_at(scenario, when.visit, when.visit_time_s);
    frame.camera = coarse;
    frame.depth_m = render(scene, coarse, frame.T_W_C, false, pool).depth_m;
    for (std::size_t c = 0; c < truth.changes.size(); ++c) {
      if (truth.changes[c].visit != when.visit) continue;
      look(frame, i, options, Look::kThrough, places[c].before);
      look(frame, i, options, Look::kHit, places[c].after);
    }
    if (when.visit != last ||
        when.robot_frame % static_cast<std::size_t>(options.frame_stride) != 0)
      continue;
    frame.camera = half;
    frame.depth_m = render(scene, half, frame.T_W_C, false, pool).depth_m;
    truth.observed.add(frame, options.frame_stride);
  }
  truth.visit_begin.push_back(schedule.frames().size());
  for (std::size_t c = 0; c < truth.changes.size(); ++c) {
    truth.changes[c].old_place_frame = half_seen(places[c].before);
    truth.changes[c].new_place_frame = half_seen(places[c].after);
  }
  return truth;
}

}  // namespace pocd
