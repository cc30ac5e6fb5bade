// The project's IDL files, put into the program when it is built.
#pragma once

#include <map>
#include <string>

namespace pocd::dds {

/// Text by file name.
std::map<std::string, std::string> embedded_idl();

}  // namespace pocd::dds
