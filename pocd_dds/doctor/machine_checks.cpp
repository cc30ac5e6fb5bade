#include "pocd_dds/doctor/machine_checks.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
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

/// "" when a packet to RTPS's multicast group, sent through the interface with this address, comes
/// back to this machine; else why not.
std::string multicast_problem(const in_addr& interface) {
  constexpr int kWaitMs = 300;
  struct Socket {
    int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ~Socket() {
      if (descriptor >= 0) close(descriptor);
    }
  };
  const Socket in, out;
  sockaddr_in group{};
  group.sin_family = AF_INET;
  socklen_t size = sizeof group;
  const auto failed = [](const char* what) { return std::string(what) + ": " + strerror(errno); };
  const auto set = [&](const Socket& on, int option, const auto& value) {
    return setsockopt(on.descriptor, IPPROTO_IP, option, &value, sizeof value) == 0;
  };
  // Any free port: those of RTPS are the participants'.
  if (bind(in.descriptor, reinterpret_cast<const sockaddr*>(&group), size) != 0 ||
      getsockname(in.descriptor, reinterpret_cast<sockaddr*>(&group), &size) != 0) {
    return failed("no socket");
  }
  group.sin_addr.s_addr = inet_addr("239.255.0.1");
  const ip_mreq membership{group.sin_addr, interface};
  if (!set(in, IP_ADD_MEMBERSHIP, membership)) return failed("cannot join a group");
  if (!set(out, IP_MULTICAST_IF, interface)) return failed("cannot send to a group");
  const char packet[] = "pocd";
  if (sendto(out.descriptor, packet, sizeof packet, 0, reinterpret_cast<const sockaddr*>(&group),
             size) < 0) {
    return failed("cannot send to a group");
  }
  pollfd ready{in.descriptor, POLLIN, 0};
  return poll(&ready, 1, kWaitMs) == 1 ? "" : "what is sent to a group does not arrive";
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

std::map<std::string, std::string> multicast_by_interface() {
  std::map<std::string, std::string> problems;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return problems;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if ((one->ifa_flags & IFF_UP) == 0) continue;
    problems[one->ifa_name] =
        multicast_problem(reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr);
  }
  freeifaddrs(all);
  return problems;
}

Findings check_multicast(const std::map<std::string, std::string>& by_interface) {
  Findings findings;
  const bool none = std::none_of(by_interface.begin(), by_interface.end(),
                                 [](const auto& entry) { return entry.second.empty(); });
  for (const auto& [name, problem] : by_interface) {
    if (problem.empty()) continue;
    // With another interface that carries it, participants find each other through that one.
    findings.push_back({none ? Severity::kError : Severity::kNote, "multicast on " + name, problem,
                        "participants do not find each other through it: let it through (firewall, "
                        "sandbox), or give them initial peers "
                        "(--profiles launch_scripts/no_multicast.xml) or a ROS_DISCOVERY_SERVER"});
  }
  if (by_interface.empty()) {
    findings.push_back(
        {Severity::kError, "network", "no IPv4 interface is up", "ip link set lo up, at least"});
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
