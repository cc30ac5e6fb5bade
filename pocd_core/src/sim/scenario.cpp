#include "pocd/sim/scenario.hpp"

#include <cmath>
#include <limits>
#include <set>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

SceneObject slab(const std::string& name, ClassId class_id, const Eigen::Vector3d& centre_m,
                 const Eigen::Vector3d& size_m, const Eigen::Vector3d& rgb) {
  SceneObject object;
  object.name = name;
  object.class_id = class_id;
  object.stationarity_class = 1;
  object.fixture = true;
  object.T_W_O = upright_pose(centre_m, 0.0);
  ScenePart part;
  part.size_m = size_m;
  part.rgb = rgb;
  part.texture = Texture::kConcrete;
  object.parts.push_back(part);
  return object;
}

void validate_object(const SceneObject& object, const Scenario& scenario,
                     const std::string& where) {
  const std::string what = where + ": object '" + object.name + "' ";
  if (object.parts.empty()) throw InputError(what + "has no parts");
  for (const ScenePart& part : object.parts) {
    if (!part.size_m.allFinite() || part.size_m.minCoeff() <= 0.0) {
      throw InputError(what + "has a size that is not > 0");
    }
  }
  if (object.transient && object.track.empty())
    throw InputError(what + "is transient without track");
  for (std::size_t i = 1; i < object.track.size(); ++i) {
    if (object.track[i].time_s < object.track[i - 1].time_s) {
      throw InputError(what + "has a track that goes back in time");
    }
  }
  SceneObject moved = object;
  for (const double time_s : {0.0, std::numeric_limits<double>::infinity()}) {
    moved.T_W_O = pose_at(object, time_s);
    const OrientedBox box = bounding_box(moved);
    const double c = std::abs(std::cos(box.pose.yaw_rad)), s = std::abs(std::sin(box.pose.yaw_rad));
    const Eigen::Vector2d reach(0.5 * (c * box.size_m.x() + s * box.size_m.y()),
                                0.5 * (s * box.size_m.x() + c * box.size_m.y()));
    const Eigen::Vector2d centre = box.pose.position_W.head<2>();
    if (((centre - reach).array() < scenario.area_low_m.array()).any() ||
        ((centre + reach).array() > scenario.area_high_m.array()).any()) {
      throw InputError(what + "reaches outside the area");
    }
  }
}

}  // namespace

std::vector<SceneObject> make_building(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
                                       double wall_height_m, ClassId floor_class,
                                       ClassId wall_class) {
  constexpr double kThick_m = 0.2;
  const Eigen::Vector2d centre = 0.5 * (low_m + high_m), size = high_m - low_m;
  const Eigen::Vector3d floor_rgb(150, 152, 150), wall_rgb(196, 200, 204);
  std::vector<SceneObject> out;
  out.push_back(slab("floor", floor_class, {centre.x(), centre.y(), -0.5 * kThick_m},
                     {size.x(), size.y(), kThick_m}, floor_rgb));
  const double z = 0.5 * wall_height_m;
  const double dx = 0.5 * (size.x() + kThick_m), dy = 0.5 * (size.y() + kThick_m);
  const Eigen::Vector3d across(kThick_m, size.y() + 2 * kThick_m, wall_height_m);
  const Eigen::Vector3d along(size.x() + 2 * kThick_m, kThick_m, wall_height_m);
  out.push_back(slab("wall_east", wall_class, {centre.x() + dx, centre.y(), z}, across, wall_rgb));
  out.push_back(slab("wall_west", wall_class, {centre.x() - dx, centre.y(), z}, across, wall_rgb));
  out.push_back(slab("wall_north", wall_class, {centre.x(), centre.y() + dy, z}, along, wall_rgb));
  out.push_back(slab("wall_south", wall_class, {centre.x(), centre.y() - dy, z}, along, wall_rgb));
  return out;
}

Scenario concatenate(const std::vector<Scenario>& scenarios) {
  POCD_CHECK(!scenarios.empty());
  Scenario out = scenarios.front();
  for (std::size_t i = 1; i < scenarios.size(); ++i) {
    const Scenario& next = scenarios[i];
    const auto require = [&](bool same, const char* what) {
      if (!same) {
        throw InputError("scenario '" + next.name + "' cannot follow '" + out.name + "': another " +
                         what);
      }
    };
    require(next.camera == out.camera, "camera");
    require(next.extrinsics.T_B_C.isApprox(out.extrinsics.T_B_C), "camera mount");
    require(next.base_height_m == out.base_height_m, "base height");
    require(next.frame_rate_hz == out.frame_rate_hz, "frame rate");
    require(next.robots.size() == out.robots.size(), "number of robots");
    for (std::size_t r = 0; r < out.robots.size(); ++r) {
      require(next.robots[r].name == out.robots[r].name, "robot");
    }
    out.visits.insert(out.visits.end(), next.visits.begin(), next.visits.end());
  }
  return out;
}

Scene scene_at(const Scenario& scenario, std::size_t visit, double time_s) {
  Scene scene;
  scene.objects = scenario.fixtures;
  for (const SceneObject& object : scenario.visits.at(visit).objects) {
    if (!exists_at(object, time_s)) continue;
    scene.objects.push_back(object);
    scene.objects.back().T_W_O = pose_at(object, time_s);
    scene.objects.back().track.clear();
  }
  return scene;
}

void validate(const Scenario& scenario) {
  const std::string where = "scenario '" + scenario.name + "'";
  if (scenario.visits.empty()) throw InputError(where + ": no visits");
  if (scenario.robots.empty()) throw InputError(where + ": no robots");
  validate(scenario.camera, where);
  validate_pose(scenario.extrinsics.T_B_C, where + ": camera mount");
  if (!(scenario.frame_rate_hz > 0.0)) throw InputError(where + ": frame_rate_hz must be > 0");
  std::set<std::string> names;
  for (const SimRobot& robot : scenario.robots) {
    if (!names.insert(robot.name).second) {
      throw InputError(where + ": two robots named '" + robot.name + "'");
    }
    const RobotPath path(robot.path, where + ": robot '" + robot.name + "'");
  }
  for (const SimVisit& visit : scenario.visits) {
    names.clear();
    for (const SceneObject& object : visit.objects) {
      if (!names.insert(object.name).second) {
        throw InputError(where + ": two objects named '" + object.name + "'");
      }
      validate_object(object, scenario, where + ", visit '" + visit.name + "'");
    }
  }
}

}  // namespace pocd
