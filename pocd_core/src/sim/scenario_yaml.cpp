#include "pocd/sim/scenario_yaml.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "object_yaml.hpp"
#include "pocd/common/check.hpp"
#include "sensor_yaml.hpp"
#include "yaml_fields.hpp"

namespace pocd {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr int kMaxBaseDepth = 8;

SceneObject& find(std::vector<SceneObject>& objects, const std::string& name,
                  const std::string& where) {
  for (SceneObject& object : objects) {
    if (object.name == name) return object;
  }
  throw InputError(where + ": no object named '" + name + "'");
}

std::vector<std::string> names_of(const YAML::Node& node, const std::string& where) {
  std::vector<std::string> names;
  if (node.IsScalar()) names.push_back(node.Scalar());
  if (node.IsSequence()) {
    for (const YAML::Node& entry : node) {
      if (!entry.IsScalar()) throw InputError(where + ": must be a name or a list of names");
      names.push_back(entry.Scalar());
    }
  }
  if (names.empty()) throw InputError(where + ": must be a name or a list of names");
  return names;
}

std::vector<TrackPoint> to_track(YamlFields& fields) {
  const YAML::Node list = fields.node("track");
  if (!list.IsSequence() || list.size() < 2) fields.fail("track", "must list at least 2 points");
  std::vector<TrackPoint> track;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Eigen::VectorXd p =
        number_list(list[i], 4, fields.where() + ": track[" + std::to_string(i) + "]");
    track.push_back({p[0], {p[1], p[2]}, kDegree * p[3]});
  }
  return track;
}

void apply_move(YamlFields& fields, std::vector<SceneObject>& objects) {
  for (const std::string& name : names_of(fields.node("move"), fields.where() + ": key 'move'")) {
    SceneObject& object = find(objects, name, fields.where());
    if (fields.has("by") == fields.has("to")) fields.fail("by", "or 'to' is needed, and only one");
    const Eigen::Vector3d step = fields.numbers(fields.has("by") ? "by" : "to", 3);
    const Eigen::Vector3d from = object.T_W_O.translation();
    if (fields.has("by")) {
      object.T_W_O.linear() =
          Eigen::AngleAxisd(kDegree * step.z(), Eigen::Vector3d::UnitZ()) * object.T_W_O.linear();
      object.T_W_O.translation() += Eigen::Vector3d(step.x(), step.y(), 0.0);
    } else {
      // Keeps height and lean: only the upright frame under the object moves.
      const Eigen::Matrix3d& R = object.T_W_O.linear();
      const Pose T_W_H = upright_pose({from.x(), from.y(), 0.0}, std::atan2(R(1, 0), R(0, 0)));
      object.T_W_O = upright_pose({step.x(), step.y(), 0.0}, kDegree * step.z()) *
                     (T_W_H.inverse() * object.T_W_O);
    }
  }
}

void apply_change(const YAML::Node& node, const std::string& where, const YAML::Node& kinds,
                  MeshFiles& files, std::vector<SceneObject>& objects) {
  YamlFields fields(node, where);
  if (fields.has("move")) {
    apply_move(fields, objects);
  } else if (fields.has("remove")) {
    for (const std::string& name : names_of(fields.node("remove"), where + ": key 'remove'")) {
      const SceneObject* gone = &find(objects, name, where);
      objects.erase(objects.begin() + (gone - objects.data()));
    }
  } else if (fields.has("add")) {
    objects.push_back(to_object(fields.node("add"), where + ": add", kinds, files));
  } else if (fields.has("drive")) {
    find(objects, fields.text("drive"), where).track = to_track(fields);
  } else if (fields.has("pass")) {
    SceneObject object = to_object(fields.node("pass"), where + ": pass", kinds, files);
    object.track = to_track(fields);
    object.transient = true;
    objects.push_back(object);
  } else {
    throw InputError(where + ": none of move, remove, add, drive, pass");
  }
  fields.finish();
}

void apply_changes(YamlFields& fields, const YAML::Node& kinds, MeshFiles& files,
                   std::vector<SceneObject>& objects) {
  if (!fields.has("changes")) return;
  const YAML::Node list = fields.node("changes");
  if (!list.IsSequence()) fields.fail("changes", "must be a list");
  for (std::size_t i = 0; i < list.size(); ++i) {
    apply_change(list[i], fields.where() + ": changes[" + std::to_string(i) + "]", kinds, files,
                 objects);
  }
}

/// Objects as the next visit finds them.
std::vector<SceneObject> settled(std::vector<SceneObject> objects) {
  objects.erase(std::remove_if(objects.begin(), objects.end(),
                               [](const SceneObject& object) { return object.transient; }),
                objects.end());
  for (SceneObject& object : objects) {
    object.T_W_O = pose_at(object, std::numeric_limits<double>::infinity());
    object.track.clear();
  }
  return objects;
}

SimRobot to_robot(const YAML::Node& node, const std::string& where) {
  YamlFields fields(node, where);
  SimRobot robot;
  robot.name = fields.text("name");
  YamlFields path(fields.node("path"), where + ": path");
  const YAML::Node points = path.node("waypoints");
  for (std::size_t i = 0; i < points.size(); ++i) {
    robot.path.waypoints_m.push_back(
        number_list(points[i], 2, where + ": waypoints[" + std::to_string(i) + "]"));
  }
  robot.path.closed = path.boolean("closed", robot.path.closed);
  robot.path.speed_m_s = path.number("speed_m_s", robot.path.speed_m_s);
  robot.path.turn_rate_rad_s =
      kDegree * path.number("turn_rate_deg_s", robot.path.turn_rate_rad_s / kDegree);
  robot.path.corner_radius_m = path.number("corner_radius_m", robot.path.corner_radius_m);
  robot.path.start_m = path.number("start_m", robot.path.start_m);
  robot.path.laps = path.integer("laps", robot.path.laps);
  path.finish();
  fields.finish();
  return robot;
}

Pose to_mount(YamlFields& fields) {
  Pose T_B_C = Pose::Identity();
  T_B_C.translation() = fields.numbers("translation", 3);
  if (fields.has("quaternion_xyzw")) {
    const Eigen::VectorXd q = fields.numbers("quaternion_xyzw", 4);
    if (std::abs(q.norm() - 1.0) > 1e-2) fields.fail("quaternion_xyzw", "must have length 1");
    T_B_C.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  } else {
    Eigen::Matrix3d optical;  // x right, y down, z forward of a camera looking along +x
    optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T_B_C.linear() =
        Eigen::AngleAxisd(kDegree * fields.number("yaw_deg", 0.0), Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(-kDegree * fields.number("pitch_deg", 0.0), Eigen::Vector3d::UnitY()) *
        optical;
  }
  fields.finish();
  return T_B_C;
}

SensorModel to_sensor(const YAML::Node& node, const MeshFiles& files, const std::string& where) {
  if (!node.IsScalar()) return sensor_of(node, where);
  const std::string word = node.Scalar();
  if (const auto kind = value_of<SensorKind>(word)) return SensorModel::of(*kind);
  const std::filesystem::path file = files.find(word);
  if (!file.empty() && file.extension() == ".yaml") return load_sensor(file);
  throw InputError(where + " must be perfect, stereo, a YAML file or a map, is '" + word + "'");
}

/// What a scenario hands on to those that it is the base of.
struct Loaded {
  Scenario scenario;
  YAML::Node kinds;
  MeshFiles files;
};

void read_area(YamlFields& area, Scenario& scenario) {
  scenario.area_low_m = area.numbers("low", 2);
  scenario.area_high_m = area.numbers("high", 2);
  const auto class_of = [&](const char* key, int otherwise) {
    return static_cast<ClassId>(area.integer(key, otherwise));
  };
  scenario.fixtures =
      make_building(scenario.area_low_m, scenario.area_high_m, area.number("wall_height_m", 4.0),
                    class_of("floor_class", 1), class_of("wall_class", 0));
  area.finish();
}

void read_world(YamlFields& top, const std::string& where, const MeshFiles& files,
                Scenario& scenario) {
  if (top.has("camera")) {
    YamlFields camera(top.node("camera"), where + ": camera");
    scenario.camera = {camera.integer("width"), camera.integer("height"), camera.number("fx"),
                       camera.number("fy"),     camera.number("cx"),      camera.number("cy")};
    camera.finish();
  }
  if (top.has("mount")) {
    YamlFields mount(top.node("mount"), where + ": mount");
    scenario.extrinsics.T_B_C = to_mount(mount);
  }
  scenario.base_height_m = top.number("base_height_m", scenario.base_height_m);
  scenario.frame_rate_hz = top.number("frame_rate_hz", scenario.frame_rate_hz);
  scenario.visit_gap_s = top.number("visit_gap_s", scenario.visit_gap_s);
  if (top.has("area")) {
    YamlFields area(top.node("area"), where + ": area");
    read_area(area, scenario);
  }
  if (top.has("sensor")) {
    scenario.sensor = to_sensor(top.node("sensor"), files, where + ": key 'sensor'");
  }
  if (top.has("robots")) {
    scenario.robots.clear();
    const YAML::Node robots = top.node("robots");
    for (std::size_t i = 0; i < robots.size(); ++i) {
      scenario.robots.push_back(to_robot(robots[i], where + ": robots[" + std::to_string(i) + "]"));
    }
  }
}

Loaded load(const std::filesystem::path& file, int depth) {
  const std::string where = file.string();
  if (depth > kMaxBaseDepth) throw InputError(where + ": bases are nested too deeply");
  YamlFields top(load_yaml_file(file), where);
  Loaded out;
  std::vector<SceneObject> objects;
  if (top.has("base")) {
    out = load(file.parent_path() / top.text("base"), depth + 1);
    if (!out.scenario.visits.empty()) objects = settled(out.scenario.visits.back().objects);
    out.scenario.visits.clear();
  } else {
    out.scenario.camera = torwic_camera();
    out.scenario.extrinsics = torwic_extrinsics();
    out.scenario.fixtures =
        make_building(out.scenario.area_low_m, out.scenario.area_high_m, 4.0, 1, 0);
  }
  Scenario& scenario = out.scenario;
  scenario.name = top.text("name");
  scenario.description = top.text("description", "");
  out.files.add_folder(file.parent_path());
  read_world(top, where, out.files, scenario);
  if (top.has("kinds")) out.kinds.reset(top.node("kinds"));
  if (top.has("objects")) {
    const YAML::Node list = top.node("objects");
    for (std::size_t i = 0; i < list.size(); ++i) {
      objects.push_back(
          to_object(list[i], where + ": objects[" + std::to_string(i) + "]", out.kinds, out.files));
    }
  }
  if (top.has("visits")) {
    const YAML::Node visits = top.node("visits");
    for (std::size_t i = 0; i < visits.size(); ++i) {
      YamlFields visit(visits[i], where + ": visits[" + std::to_string(i) + "]");
      if (i > 0) objects = settled(objects);
      apply_changes(visit, out.kinds, out.files, objects);
      scenario.visits.push_back({visit.text("name"), objects});
      visit.finish();
    }
  } else {
    apply_changes(top, out.kinds, out.files, objects);
    scenario.visits.push_back({scenario.name, objects});
  }
  top.finish();
  return out;
}

}  // namespace

Scenario load_scenario(const std::filesystem::path& file) {
  const Scenario scenario = load(file, 0).scenario;
  try {
    validate(scenario);
  } catch (const InputError& error) {
    throw InputError(file.string() + ": " + error.what());
  }
  return scenario;
}

Scenario load_run(const std::vector<std::filesystem::path>& files) {
  if (files.empty()) throw InputError("simulator: no scenario file given");
  std::vector<Scenario> scenarios;
  for (const std::filesystem::path& file : files) scenarios.push_back(load_scenario(file));
  return concatenate(scenarios);
}

}  // namespace pocd
