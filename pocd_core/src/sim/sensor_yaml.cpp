#include "pocd/common/check.hpp"
#include "sensor_yaml.hpp"

namespace pocd {
namespace {

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

}  // namespace

SensorModel sensor_of(const YAML::Node& node, const std::string& where) {
  SensorModel model;
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

SensorModel load_sensor(const std::filesystem::path& file) {
  return sensor_of(load_yaml_file(file), file.string());
}

}  // namespace pocd
