#include "evaluation_methods.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/eval/published_method.hpp"

namespace pocd {

MethodSpec make_method(const Variant& variant, const BaseConfig& base) {
  std::vector<std::filesystem::path> files = base.files;
  files.insert(files.end(), variant.config.begin(), variant.config.end());
  std::vector<std::string> overrides = base.overrides;
  PipelineConfig config;
  BaselineConfig own;
  if (variant.method == Method::kPocd) {
    overrides.insert(overrides.end(), variant.set.begin(), variant.set.end());
  } else {
    load_config(own, base.method_files, variant.set);
  }
  load_config(config, files, overrides);
  MethodSpec spec;
  spec.name = variant.name;
  switch (variant.method) {
    case Method::kPocd:
      spec.make = [=] { return make_pocd_method(config); };
      break;
    case Method::kPublished:
      spec.make = [=] { return make_published_method(config, own.published); };
      break;
    case Method::kStaticTsdf:
      spec.make = [=] { return make_static_tsdf_method(config, own.static_tsdf); };
      break;
    case Method::kSubmaps:
      spec.make = [=] { return make_submap_method(config, own.submaps); };
      break;
    case Method::kVoxelCorrection:
      spec.make = [=] { return make_voxel_correction_method(config, own.voxel_correction); };
      break;
    case Method::kTrackedObjects:
    case Method::kTrackedObjectsKeep:
      own.tracked_objects.keep_lost |= variant.method == Method::kTrackedObjectsKeep;
      spec.make = [=] { return make_tracked_objects_method(config, own.tracked_objects); };
      break;
  }
  return spec;
}

std::vector<Variant> load_variants(const std::filesystem::path& file) {
  VariantList list;
  load_config(list, {file});
  for (Variant& variant : list.variants) {
    if (variant.name.empty()) throw InputError(file.string() + ": a variant has no name");
    for (std::string& config : variant.config) config = (file.parent_path() / config).string();
  }
  return list.variants;
}

Variant parse_variant(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
    throw InputError("--variant: \"" + text + "\" is not NAME=OVERLAY");
  }
  Variant variant;
  variant.name = text.substr(0, equals);
  const std::string overlay = text.substr(equals + 1);
  if (overlay.find('=') == std::string::npos) {
    variant.config.push_back(overlay);
    return variant;
  }
  for (std::size_t begin = 0; begin <= overlay.size();) {
    const std::size_t end = std::min(overlay.find(',', begin), overlay.size());
    variant.set.push_back(overlay.substr(begin, end - begin));
    begin = end + 1;
  }
  return variant;
}

}  // namespace pocd
