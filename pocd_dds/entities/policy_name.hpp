// Qualities of service by name.
#pragma once

#include <cstdint>
#include <string>

namespace pocd::dds {

/// Of a policy that a reader and a writer disagree about, by its number in DDS: "reliability", ...
std::string policy_name(std::int32_t policy);

}  // namespace pocd::dds
