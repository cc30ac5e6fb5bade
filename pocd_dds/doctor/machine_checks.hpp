// Settings of the machine that the bus depends on.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "pocd_dds/doctor/finding.hpp"

namespace pocd::dds {

/// Socket buffers, reassembly of fragments. `proc` is /proc.
Findings check_network_settings(const std::filesystem::path& proc);

/// Room for shared memory, and segments that dead processes left. `folder` is /dev/shm.
Findings check_shared_memory(const std::filesystem::path& folder);

/// For every IPv4 interface that is up: "" when what is sent to a multicast group through it
/// arrives on this machine, else why not. Takes 0.3 s for each where nothing arrives.
std::map<std::string, std::string> multicast_by_interface();
Findings check_multicast(const std::map<std::string, std::string>& by_interface);

/// What Fast DDS picks up by itself: a profiles file in `folder` (the working directory),
/// variables.
Findings check_environment(const std::filesystem::path& folder);

}  // namespace pocd::dds
