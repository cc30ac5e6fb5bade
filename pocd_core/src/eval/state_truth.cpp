#include "pocd/eval/state_truth.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "pocd/segmentation/observations.hpp"

namespace pocd {
namespace {

constexpr int kInstanceDivisor = 100;
constexpr ClassId kThingClass = 2;  // of the PCD reader
constexpr double kSameCenter_m = 0.01;
/// Depth within this of a point's own is the point's surface: three sigma of the camera at 1 m.
constexpr double kSameDepth_m = 0.02;
/// Share of a thing's points below which what is seen of it tells nothing.
constexpr double kLeastSeen = 0.02;

struct Instance {
  Points points_W;
  Eigen::Vector3d mean_W = Eigen::Vector3d::Zero();
};

std::map<int, Instance> instances_of(const Frame& frame) {
  std::map<int, Instance> instances;
  for (int v = 0; v < frame.depth_m.rows; ++v) {
    for (int u = 0; u < frame.depth_m.cols; ++u) {
      const float depth = frame.depth_m.at<float>(v, u);
      const int label = frame.labels.at<std::uint16_t>(v, u);
      if (!(depth > 0.0f) || label / kInstanceDivisor != kThingClass) continue;
      const Eigen::Vector3d point_W = frame.T_W_C * frame.camera.back_project(u, v, depth);
      Instance& instance = instances[label % kInstanceDivisor];
      instance.points_W.push_back(point_W.cast<float>());
      instance.mean_W += point_W;
    }
  }
  for (auto& [id, instance] : instances)
    instance.mean_W /= static_cast<double>(instance.points_W.size());
  return instances;
}

/// What a frame says about the points of a thing.
struct Sight {
  double hidden = 0.0, seen_through = 0.0;  ///< shares of all points; outlines are seen through by nobody
  int hit_instance = 0;                     ///< the one most often hit
  double hit_share = 0.0;                   ///< share of points that hit it
};

/// Whether the surface at a pixel and at all its neighbours that were measured lies behind `depth_m`.
/// A pixel at the outline of what hides the point, or of the point's own thing, sees now one side of
/// the edge and now the other.
bool all_behind(const Frame& frame, int v, int u, double depth_m) {
  for (int y = std::max(0, v - 1); y <= std::min(frame.camera.height - 1, v + 1); ++y) {
    for (int x = std::max(0, u - 1); x <= std::min(frame.camera.width - 1, u + 1); ++x) {
      const float other_m = frame.depth_m.at<float>(y, x);
      if (other_m > 0.0f && !(other_m > depth_m + kSameDepth_m)) return false;
    }
  }
  return true;
}

Sight look_at(const Points& points_W, const Frame& frame) {
  const Pose T_C_W = frame.T_W_C.inverse();
  const CameraModel& camera = frame.camera;
  std::map<int, int> hits;
  int hidden = 0, through = 0;
  for (const Eigen::Vector3f& point : points_W) {
    const Eigen::Vector3d p_C = T_C_W * point.cast<double>();
    const int u = static_cast<int>(std::lround(p_C.x() / p_C.z() * camera.fx + camera.cx));
    const int v = static_cast<int>(std::lround(p_C.y() / p_C.z() * camera.fy + camera.cy));
    if (u < 0 || v < 0 || u >= camera.width || v >= camera.height) continue;
    const float depth = frame.depth_m.at<float>(v, u);
    if (!(depth > 0.0f)) continue;
    if (depth < p_C.z() - kSameDepth_m) {
      ++hidden;
    } else if (depth > p_C.z() + kSameDepth_m) {
      through += all_behind(frame, v, u, p_C.z());
    } else {
      const int label = frame.labels.at<std::uint16_t>(v, u);
      if (label / kInstanceDivisor == kThingClass) ++hits[label % kInstanceDivisor];
    }
  }
  const auto n = static_cast<double>(points_W.size());
  Sight sight;
  sight.hidden = hidden / n;
  sight.seen_through = through / n;
  for (const auto& [instance, count] : hits) {
    if (count / n > sight.hit_share) sight.hit_instance = instance, sight.hit_share = count / n;
  }
  return sight;
}

ExpectedState list_state(int state, const StateTruth& truth, const Frame& frame,
                         std::vector<int>& ids) {
  ExpectedState expected;
  expected.state = state;
  const std::map<int, Instance> instances = instances_of(frame);
  for (const TruthThing& thing : truth.objects) {
    if (thing.state != state) continue;
    for (const auto& [id, instance] : instances) {
      if ((instance.mean_W - thing.center_W()).norm() > kSameCenter_m) continue;
      ExpectedObject object;
      object.listed_W = thing.center_W();
      object.points_W = instance.points_W;
      object.box = fit_box(instance.points_W, {}, 0.005);
      expected.objects.push_back(std::move(object));
      ids.push_back(id);
      break;
    }
  }
  std::size_t listed = 0;
  for (const TruthThing& thing : truth.objects) listed += thing.state == state;
  if (expected.objects.size() != listed || listed != instances.size()) {
    throw InputError("state " + std::to_string(state) + ": " + std::to_string(instances.size()) +
                     " labelled things, " + std::to_string(listed) + " listed, " +
                     std::to_string(expected.objects.size()) + " of them in the same place");
  }
  return expected;
}

/// Adds what earlier states know: other centres of things that stayed, and things hidden now.
void add_history(const ExpectedState& before, const Frame& frame, const std::vector<int>& ids,
                 ExpectedState& now) {
  std::vector<const ExpectedObject*> known;
  for (const ExpectedObject& object : before.objects) known.push_back(&object);
  for (const ExpectedObject& object : before.hidden) known.push_back(&object);
  for (const ExpectedObject* object : known) {
    const Sight sight = look_at(object->points_W, frame);
    const double visible = sight.hit_share + sight.seen_through;
    // A thing that stayed shows no more of the background than the noise of its outline does; what is
    // seen of a thing that is nearly hidden is outline only.
    if (sight.seen_through > 0.15 ||
        (sight.seen_through > kLeastSeen && sight.seen_through > 0.3 * visible)) {
      continue;
    }
    if (sight.hit_share > 0.2) {
      for (std::size_t i = 0; i < ids.size(); ++i) {
        if (ids[i] != sight.hit_instance) continue;
        now.objects[i].earlier_W.push_back(object->listed_W);
        now.objects[i].earlier_W.insert(now.objects[i].earlier_W.end(), object->earlier_W.begin(),
                                        object->earlier_W.end());
      }
    } else if (sight.hidden > 0.5) {
      now.hidden.push_back(*object);
    }
  }
}

}  // namespace

Pose StateTruth::T_W_C() const {
  const TruthRotation& q = camera_pose.rotation;
  const TruthVector& t = camera_pose.translation;
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(t.x, t.y, t.z);
  return pose;
}

DatasetOptions state_dataset(const StateTruth& truth, const std::filesystem::path& folder) {
  DatasetOptions options;
  options.format = DatasetFormat::kPcd;
  options.inputs = {folder};
  options.repeat = truth.frames_per_state;
  options.camera = truth.camera.model;
  options.T_W_C = truth.T_W_C();
  return options;
}

std::vector<ExpectedState> expected_states(const StateTruth& truth,
                                           const std::filesystem::path& folder) {
  DatasetOptions options = state_dataset(truth, folder);
  options.repeat = 1;
  options.label_divisor = kInstanceDivisor;
  const auto reader = open_pcd(options);
  std::vector<ExpectedState> states;
  while (const auto frame = reader->next()) {
    std::vector<int> ids;
    ExpectedState now = list_state(static_cast<int>(states.size()), truth, *frame, ids);
    if (!states.empty()) add_history(states.back(), *frame, ids, now);
    states.push_back(std::move(now));
  }
  if (!reader->problems().empty()) throw InputError(reader->problems().front());
  return states;
}

}  // namespace pocd
