// The files of Fast DDS's shared-memory ports, as this process has opened them and as they are now.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace pocd::dds {

/// Where ports, segments and locks are.
inline const std::filesystem::path kSharedMemoryFolder = "/dev/shm";

std::filesystem::path port_file(std::uint32_t port);

/// Tells files of one name apart; 0: there is none.
std::uint64_t port_file_id(std::uint32_t port);

/// Whether this process has this file of the port open, also when it was deleted since.
bool has_port_file(std::uint32_t port, std::uint64_t id);

/// Keeps the files of ports while it lives: whoever closes a port that was made anew under its name
/// last, deletes the new file in place of the old one.
class PortFileGuard {
 public:
  explicit PortFileGuard(std::uint32_t port);
  ~PortFileGuard();
  PortFileGuard(PortFileGuard&& other) noexcept;
  PortFileGuard& operator=(PortFileGuard&&) = delete;

 private:
  std::filesystem::path file_, second_name_;
};

}  // namespace pocd::dds
