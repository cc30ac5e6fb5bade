// Programs whose discovery can be made to stand still.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace pocd {

/// The command in a form in which discovery hangs as long as the file exists. Not with a sanitizer
/// in the program, which has to be loaded first itself.
inline std::vector<std::string> with_hung_discovery(const std::filesystem::path& file,
                                                    std::vector<std::string> command) {
  command.insert(command.begin(), {"/usr/bin/env", "LD_PRELOAD=" POCD_HUNG_DISCOVERY,
                                   "POCD_HANG_FILE=" + file.string()});
  return command;
}

inline bool sanitized() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return true;
#else
  return false;
#endif
}

}  // namespace pocd
