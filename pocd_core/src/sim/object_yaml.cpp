#include "object_yaml.hpp"

#include <cmath>

#include "pocd/common/check.hpp"
#include "pocd/sim/triangle_mesh.hpp"

namespace pocd {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// Shape, size and looks; the base of the part at `base` in the object's frame.
ScenePart to_part(YamlFields& fields, const Eigen::Vector3d& base, double yaw_rad,
                  MeshFiles& meshes) {
  ScenePart part;
  if (fields.has("mesh")) {
    const double scale = fields.number("scale", 1.0);
    if (!(scale > 0.0)) fields.fail("scale", "must be > 0");
    part.shape = Shape::kMesh;
    part.mesh = meshes.get(fields.text("mesh"), scale, fields.where());
    part.size_m = part.mesh->size_m();
  } else {
    part.shape = fields.choice("shape", Shape::kBox);
    part.size_m = fields.numbers("size", 3);
  }
  if (fields.has("rgb")) part.rgb = fields.numbers("rgb", 3);
  part.texture = fields.choice("texture", Texture::kPlain);
  part.T_O_P = upright_pose(base + Eigen::Vector3d(0, 0, 0.5 * part.size_m.z()), yaw_rad);
  return part;
}

}  // namespace

SceneObject to_object(const YAML::Node& node, const std::string& where, const YAML::Node& kinds,
                      MeshFiles& meshes) {
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
      object.parts.push_back(to_part(part, at, yaw_rad, meshes));
      part.finish();
    }
  } else {
    object.parts.push_back(to_part(fields, Eigen::Vector3d::Zero(), 0.0, meshes));
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

void MeshFiles::add_folder(const std::filesystem::path& folder) {
  folders_.insert(folders_.begin(), folder);
}

std::filesystem::path MeshFiles::find(const std::string& name) const {
  for (const std::filesystem::path& folder : folders_) {
    if (std::filesystem::exists(folder / name)) return folder / name;
  }
  return {};
}

std::shared_ptr<const TriangleMesh> MeshFiles::get(const std::string& name, double scale,
                                                   const std::string& where) {
  const std::filesystem::path file = find(name);
  if (file.empty()) {
    throw InputError(where + ": key 'mesh': no file '" + name +
                     "' beside the scenario or its bases");
  }
  std::shared_ptr<const TriangleMesh>& mesh = read_[{file, scale}];
  if (!mesh) mesh = load_obj(file, scale);
  return mesh;
}

}  // namespace pocd
