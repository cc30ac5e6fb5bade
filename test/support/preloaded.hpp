// Programs in which a function of Fast DDS is another one.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace pocd {

/// Not with a sanitizer in the program, which has to be loaded first itself.
inline std::vector<std::string> preloaded(const std::string& module,
                                          std::vector<std::string> command) {
  command.insert(command.begin(), {"/usr/bin/env", "LD_PRELOAD=" + module});
  return command;
}

/// The command in a form in which discovery hangs as long as the file exists.
inline std::vector<std::string> with_hung_discovery(const std::string& module,
                                                    const std::filesystem::path& file,
                                                    std::vector<std::string> command) {
  command = preloaded(module, std::move(command));
  command.insert(command.begin() + 1, "POCD_HANG_FILE=" + file.string());
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
