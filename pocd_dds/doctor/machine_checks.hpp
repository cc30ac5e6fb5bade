// Settings of the machine that the bus depends on.
#pragma once

#include <filesystem>

#include "pocd_dds/doctor/finding.hpp"

namespace pocd::dds {

/// Socket buffers, reassembly of fragments. `proc` is /proc.
Findings check_network_settings(const std::filesystem::path& proc);

/// Room for shared memory, and segments that dead processes left. `folder` is /dev/shm.
Findings check_shared_memory(const std::filesystem::path& folder);

/// What Fast DDS picks up by itself: a profiles file in `folder` (the working directory),
/// variables.
Findings check_environment(const std::filesystem::path& folder);

}  // namespace pocd::dds
