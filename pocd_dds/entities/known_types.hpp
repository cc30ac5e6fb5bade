// The types whose IDL is part of this program.
#pragma once

#include <map>
#include <string>

#include "pocd/recording/idl_schema.hpp"

namespace pocd::dds {

/// The project's IDL files by name, put into the program when it is built.
std::map<std::string, std::string> embedded_idl();
/// What they define. Thread-safe.
const recording::IdlLibrary& known_types();
/// "nav_msgs::msg::dds_::Odometry_" -> "nav_msgs::msg::Odometry"; other names stay.
std::string plain_type(const std::string& dds_type);

}  // namespace pocd::dds
