#include "pocd_dds/doctor/machine_checks.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

namespace pocd::dds {
namespace {

constexpr std::uint64_t kMiB = 1u << 20;
// What the participant asks for: socket buffers, and a segment of shared memory each for three
// processes.
constexpr std::uint64_t kSocketBytes = 4 * kMiB;
constexpr std::uint64_t kSharedBytes = 3 * 32 * kMiB;

std::optional<std::uint64_t> number_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::uint64_t value = 0;
  if (!(in >> value)) return std::nullopt;
  return value;
}

/// True when a live process holds the lock on the file.
bool is_held(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return true;  // somebody else's
  const bool held = flock(descriptor, LOCK_EX | LOCK_NB) != 0;
  close(descriptor);
  return held;
}

}  // namespace

Findings check_network_settings(const std::filesystem::path& proc) {
  Findings findings;
  for (const char* name : {"rmem_max", "wmem_max"}) {
    const auto value = number_in(proc / "sys/net/core" / name);
    if (!value || *value >= kSocketBytes) continue;
    findings.push_back(
        {Severity::kWarning, std::string("net.core.") + name,
         std::to_string(*value) + " bytes, images over UDP need " + std::to_string(kSocketBytes),
         std::string("sysctl -w net.core.") + name + "=" + std::to_string(kSocketBytes)});
  }
  const auto ipfrag_time = number_in(proc / "sys/net/ipv4/ipfrag_time");
  if (ipfrag_time && *ipfrag_time > 3) {
    findings.push_back({Severity::kNote, "net.ipv4.ipfrag_time",
                        std::to_string(*ipfrag_time) +
                            " s: on a network that loses fragments, large samples stall",
                        "for robots on other hosts: sysctl -w net.ipv4.ipfrag_time=3"});
  }
  return findings;
}

Findings check_shared_memory(const std::filesystem::path& folder) {
  Findings findings;
  struct statvfs space {};
  if (statvfs(folder.c_str(), &space) != 0) {
    findings.push_back({Severity::kWarning, folder.string(), "cannot be read",
                        "mount a tmpfs there; without it, everything goes over UDP"});
    return findings;
  }
  const std::uint64_t free_bytes = std::uint64_t{space.f_bavail} * space.f_frsize;
  if (free_bytes < kSharedBytes) {
    findings.push_back({Severity::kError, folder.string(),
                        std::to_string(free_bytes / kMiB) + " MiB free, " +
                            std::to_string(kSharedBytes / kMiB) + " are wanted",
                        "enlarge it (docker: --shm-size) or remove what is left over"});
  }
  std::size_t left_over = 0;
  std::uint64_t bytes = 0;
  std::error_code problem;
  for (const auto& entry : std::filesystem::directory_iterator(folder, problem)) {
    const std::string name = entry.path().filename().string();
    // A segment NAME is locked through NAME_el for as long as its process lives.
    const bool segment = name.compare(0, 9, "fastrtps_") == 0 &&
                         name.compare(0, 13, "fastrtps_port") != 0 &&
                         name.find("_el") == std::string::npos;
    const std::filesystem::path lock = entry.path().string() + "_el";
    if (!segment || !std::filesystem::exists(lock, problem) || is_held(lock)) continue;
    ++left_over;
    bytes += entry.file_size(problem);
  }
  if (left_over > 0) {
    findings.push_back({Severity::kWarning, folder.string(),
                        std::to_string(left_over) + " segments (" + std::to_string(bytes / kMiB) +
                            " MiB) of processes that were killed",
                        "fastdds shm clean"});
  }
  return findings;
}

Findings check_environment(const std::filesystem::path& folder) {
  Findings findings;
  const auto file = folder / "DEFAULT_FASTRTPS_PROFILES.xml";
  const char* skip = std::getenv("SKIP_DEFAULT_XML");
  if (std::filesystem::exists(file) && (skip == nullptr || std::string(skip) != "1")) {
    findings.push_back({Severity::kWarning, file.string(),
                        "is loaded silently by every program that starts here",
                        "set SKIP_DEFAULT_XML=1, or use --profiles"});
  }
  for (const char* name : {"FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_DISCOVERY_SERVER"}) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    findings.push_back({Severity::kNote, name, std::string("is set to ") + value,
                        "every process on this bus needs the same"});
  }
  return findings;
}

}  // namespace pocd::dds
