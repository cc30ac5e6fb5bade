#include "pocd_dds/entities/port_files.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <utility>

namespace pocd::dds {

std::filesystem::path port_file(std::uint32_t port) {
  return kSharedMemoryFolder / ("fastrtps_port" + std::to_string(port));
}

std::uint64_t port_file_id(std::uint32_t port) {
  struct stat state {};
  return stat(port_file(port).c_str(), &state) == 0 ? std::uint64_t{state.st_ino} : 0;
}

bool has_port_file(std::uint32_t port, std::uint64_t id) {
  const std::string name = port_file(port).string();
  std::ifstream maps("/proc/self/maps");
  std::string line;
  while (std::getline(maps, line)) {
    if (line.find(name) == std::string::npos) continue;
    // address permissions offset device inode path, and "(deleted)"
    std::istringstream words(line);
    std::string skipped, path;
    std::uint64_t inode = 0;
    words >> skipped >> skipped >> skipped >> skipped >> inode >> path;
    if (path == name && inode == id) return true;
  }
  return false;
}

PortFileGuard::PortFileGuard(std::uint32_t port)
    : file_(port_file(port)),
      second_name_(kSharedMemoryFolder /
                   ("pocd_keeps_" + std::to_string(getpid()) + "_" + std::to_string(port))) {
  if (link(file_.c_str(), second_name_.c_str()) != 0) second_name_.clear();
}

PortFileGuard::PortFileGuard(PortFileGuard&& other) noexcept
    : file_(std::move(other.file_)), second_name_(std::exchange(other.second_name_, {})) {}

PortFileGuard::~PortFileGuard() {
  if (second_name_.empty()) return;
  // Fails where the file is still there, or there again.
  (void)!link(second_name_.c_str(), file_.c_str());
  unlink(second_name_.c_str());
}

}  // namespace pocd::dds
