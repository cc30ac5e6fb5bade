// Objects of a scenario file, and the files of meshes that they name.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pocd/sim/scene.hpp"
#include "yaml_fields.hpp"

namespace pocd {

/// Files are named relative to the scenario or to one of its bases. Each is read once.
class MeshFiles {
 public:
  /// Searched before the folders that were added earlier.
  void add_folder(const std::filesystem::path& folder);
  /// Empty when no folder has such a file. An absolute name is itself.
  std::filesystem::path find(const std::string& name) const;
  /// Throws InputError for a missing or damaged file; `where` begins the text.
  std::shared_ptr<const TriangleMesh> get(const std::string& name, double scale,
                                          const std::string& where);

 private:
  std::vector<std::filesystem::path> folders_;
  std::map<std::pair<std::filesystem::path, double>, std::shared_ptr<const TriangleMesh>> read_;
};

/// An entry of `objects`; what it does not say is looked up in the kind that it names.
SceneObject to_object(const YAML::Node& node, const std::string& where, const YAML::Node& kinds,
                      MeshFiles& meshes);

}  // namespace pocd
