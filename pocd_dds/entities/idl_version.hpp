// Which definition of a type an endpoint was built with. Endpoints match by the name of their type
// alone: two that were built from different IDL would misread each other without a word.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pocd::dds {

/// Of a type of this project, by its name on the bus ("pocd_msgs::msg::dds_::ObjectState_"): 16 hex
/// digits, another value whenever a field of it, or of a type within, has another name, type or
/// place. "" for types that are not this project's. Thread-safe.
std::string idl_version(const std::string& type);
/// The same by IDL of one's own, by file name. Throws InputError for IDL that cannot be read.
std::string idl_version(const std::string& type, const std::map<std::string, std::string>& files);

/// What an endpoint of the type says in its user data: "pocd_idl=<version>;"; nothing for types
/// that are not this project's.
std::vector<std::uint8_t> idl_announcement(const std::string& type);
/// The version in user data; nothing when there is none, as of other vendors' endpoints.
std::optional<std::string> announced_idl(const std::vector<std::uint8_t>& user_data);

}  // namespace pocd::dds
