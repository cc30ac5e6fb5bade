// Methods by name, and variants of them as lists in YAML.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/eval/evaluation.hpp"

namespace pocd {

enum class Method {
  kPocd,                ///< the pipeline itself
  kPublished,           ///< make_published_method()
  kStaticTsdf,          ///< make_static_tsdf_method()
  kTrackedObjects,      ///< make_tracked_objects_method()
  kSubmaps,             ///< make_submap_method()
  kVoxelCorrection,     ///< make_voxel_correction_method()
  kTrackedObjectsKeep,  ///< tracked objects of which lost ones are kept
};
inline EnumWords<Method> words_of(Method) {
  return {{Method::kPocd, "pocd"},
          {Method::kPublished, "published"},
          {Method::kStaticTsdf, "static_tsdf"},
          {Method::kTrackedObjects, "tracked_objects"},
          {Method::kSubmaps, "submaps"},
          {Method::kVoxelCorrection, "voxel_correction"},
          {Method::kTrackedObjectsKeep, "tracked_objects_keep"}};
}

/// A method with other parameters.
struct Variant {
  std::string name;
  Method method = Method::kPocd;
  std::vector<std::string> config;
  std::vector<std::string> set;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("name", name, "Name in the tables.");
    visit("method", method, "Method that it is a variant of.");
    visit("config", config, "Configuration files over those of the command line, beside this one.");
    visit("set", set, "Parameters: GROUP.KEY=VALUE; a baseline's group is its name.");
  }
};

struct VariantList {
  std::vector<Variant> variants;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("variants", variants, "Variants in the order of the table.");
  }
};

/// The configuration that variants start from.
struct BaseConfig {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides;
  std::vector<std::filesystem::path> method_files;  ///< of BaselineConfig
};

/// Throws InputError for wrong parameters.
MethodSpec make_method(const Variant& variant, const BaseConfig& base);

/// Variants of a file; names in `config` are made relative to it. Throws InputError.
std::vector<Variant> load_variants(const std::filesystem::path& file);

/// NAME=FILE or NAME=GROUP.KEY=VALUE[,GROUP.KEY=VALUE].
Variant parse_variant(const std::string& text);

}  // namespace pocd
