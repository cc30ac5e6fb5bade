#include "pocd/sim/scenario_yaml.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pocd/common/check.hpp"
#include "yaml_fields.hpp"

namespace pocd {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr int kMaxBaseDepth = 8;

Shape to_shape(YamlFields& fields) {
  const std::string word = fields.text("shape", "box");
  if (word == "box") return Shape::kBox;
  if (word == "cylinder") return Shape::kCylinder;
  fields.fail("shape", "must be box or cylinder, is '" + word + "'");
}

Texture to_texture(YamlFields& fields) {
  const std::string word = fields.text("texture", "plain");
  if (word == "plain") return Texture::kPlain;
  if (word == "cardboard") return Texture::kCardboard;
  if (word == "tarp") return Texture::kTarp;
  if (word == "concrete") return Texture::kConcrete;
  if (word == "wood") return Texture::kWood;
  fields.fail("texture", "must be plain, cardboard, tarp, concrete or wood, is '" + word + "'");
}

/// Shape, size and looks; the base of the part at `base` in the object's frame.
ScenePart to_part(YamlFields& fields, const Eigen::Vector3d& base, double yaw_rad) {
  ScenePart part;
  part.shape = to_shape(fields);
  part.size_m = fields.numbers("size", 3);
  if (fields.has("rgb")) part.rgb = fields.numbers("rgb", 3);
  part.texture = to_texture(fields);
  part.T_O_P = upright_pose(base + Eigen::Vector3d(0, 0, 0.5 * part.size_m.z()), yaw_rad);
  return part;
}

SceneObject to_object(const YAML::Node& node, const std::string& where, const YAML::Node& kinds) {
  YamlFields probe(node, where);
  const std::string name = probe.text("name");
  const std::string place = where + " '" + name + "'";
  YAML::Node kind;
  if (probe.has("kind")) {
    const std::string word = probe.text("kind");
    if (!kinds.IsMap() || !kinds[word].IsDefined())
      probe.fail("kind", "is unknown: '" + word + "'");
    kind.reset(kinds[word]);
  }
  YamlFields fields(node, place, kind);
  SceneObject object;
  object.name = fields.text("name");
  if (fields.has("kind")) fields.text("kind");
  const int class_id = fields.integer("class");
  if (class_id < 0 || class_id > 65535) fields.fail("class", "must be in [0, 65535]");
  object.class_id = static_cast<ClassId>(class_id);
  object.stationarity_class = fields.integer("stationarity", 0);
  if (fields.has("parts")) {
    const YAML::Node parts = fields.node("parts");
    if (!parts.IsSequence()) fields.fail("parts", "must be a list");
    for (std::size_t i = 0; i < parts.size(); ++i) {
      YamlFields part(parts[i], place + ": parts[" + std::to_string(i) + "]");
      const Eigen::Vector3d at = part.has("at") ? part.numbers("at", 3) : Eigen::VectorXd::Zero(3);
      const double yaw_rad = kDegree * part.number("yaw_deg", 0.0);
      object.parts.push_back(to_part(part, at, yaw_rad));
      part.finish();
    }
  } else {
    object.parts.push_back(to_part(fields, Eigen::Vector3d::Zero(), 0.0));
  }
  const Eigen::Vector3d at = fields.has("at") ? fields.numbers("at", 3) : Eigen::VectorXd::Zero(3);
  const double lean_rad = kDegree * fields.number("lean_deg", 0.0);
  object.T_W_O = upright_pose({at.x(), at.y(), fields.number("z", 0.0)}, kDegree * at.z());
  if (lean_rad != 0.0) {
    // Tilted about its own x axis and lifted, so that it stands on its lower edge.
    const double lift = 0.5 * object.parts.front().size_m.y() * std::abs(std::sin(lean_rad));
    object.T_W_O = object.T_W_O * Eigen::Translation3d(0, 0, lift) *
                   Eigen::AngleAxisd(lean_rad, Eigen::Vector3d::UnitX());
  }
  fields.finish();
  return object;
}

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
                  std::vector<SceneObject>& objects) {
  YamlFields fields(node, where);
  if (fields.has("move")) {
    apply_move(fields, objects);
  } else if (fields.has("remove")) {
    for (const std::string& name : names_of(fields.node("remove"), where + ": key 'remove'")) {
      const SceneObject* gone = &find(objects, name, where);
      objects.erase(objects.begin() + (gone - objects.data()));
    }
  } else if (fields.has("add")) {
    objects.push_back(to_object(fields.node("add"), where + ": add", kinds));
  } else if (fields.has("drive")) {
    find(objects, fields.text("drive"), where).track = to_track(fields);
  } else if (fields.has("pass")) {
    SceneObject object = to_object(fields.node("pass"), where + ": pass", kinds);
    object.track = to_track(fields);
    object.transient = true;
    objects.push_back(object);
  } else {
    throw InputError(where + ": none of move, remove, add, drive, pass");
  }
  fields.finish();
}

void apply_changes(YamlFields& fields, const YAML::Node& kinds, std::vector<SceneObject>& objects) {
  if (!fields.has("changes")) return;
  const YAML::Node list = fields.node("changes");
  if (!list.IsSequence()) fields.fail("changes", "must be a list");
  for (std::size_t i = 0; i < list.size(); ++i) {
    apply_change(list[i], fields.where() + ": changes[" + std::to_string(i) + "]", kinds, objects);
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

/// Visits SensorModel's fields and overwrites those that the map has.
struct SensorFields {
  YamlFields& fields;
  void operator()(const char* key, double& value, Range range, const char*) {
    value = fields.number(key, value);
    if (value < range.low || value > range.high) out_of(key, range);
  }
  void operator()(const char* key, int& value, Range range, const char*) {
    value = fields.integer(key, value);
    if (value < range.low || value > range.high) out_of(key, range);
  }
  void operator()(const char* key, std::string& value, const char*) {
    value = fields.text(key, value);
  }
  void out_of(const char* key, Range range) {
    fields.fail(
        key, "must be in [" + std::to_string(range.low) + ", " + std::to_string(range.high) + "]");
  }
};

SensorModel to_sensor(const YAML::Node& node, const std::string& where) {
  SensorModel model;
  if (node.IsScalar()) {
    if (node.Scalar() == "perfect") return SensorModel::perfect();
    if (node.Scalar() == "stereo") return model;
    throw InputError(where + " must be perfect, stereo or a map, is '" + node.Scalar() + "'");
  }
  YamlFields fields(node, where);
  SensorFields visitor{fields};
  model.describe(visitor);
  fields.finish();
  try {
    model.blob_classes();
  } catch (const InputError& error) {
    throw InputError(where + ": " + error.what());
  }
  return model;
}

struct Loaded {
  Scenario scenario;
  YAML::Node kinds;
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

void read_world(YamlFields& top, const std::string& where, Scenario& scenario) {
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
  if (top.has("sensor")) scenario.sensor = to_sensor(top.node("sensor"), where + ": key 'sensor'");
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
  read_world(top, where, scenario);
  if (top.has("kinds")) out.kinds.reset(top.node("kinds"));
  if (top.has("objects")) {
    const YAML::Node list = top.node("objects");
    for (std::size_t i = 0; i < list.size(); ++i) {
      objects.push_back(
          to_object(list[i], where + ": objects[" + std::to_string(i) + "]", out.kinds));
    }
  }
  if (top.has("visits")) {
    const YAML::Node visits = top.node("visits");
    for (std::size_t i = 0; i < visits.size(); ++i) {
      YamlFields visit(visits[i], where + ": visits[" + std::to_string(i) + "]");
      if (i > 0) objects = settled(objects);
      apply_changes(visit, out.kinds, objects);
      scenario.visits.push_back({visit.text("name"), objects});
      visit.finish();
    }
  } else {
    apply_changes(top, out.kinds, objects);
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
