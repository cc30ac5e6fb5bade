// Sensor models of scenario files.
#pragma once

#include "pocd/sim/scenario_yaml.hpp"
#include "yaml_fields.hpp"

namespace pocd {

/// A map of SensorModel's fields; those that it does not have are as of a stereo camera. Throws
/// InputError, beginning with `where`.
SensorModel sensor_of(const YAML::Node& node, const std::string& where);

}  // namespace pocd
