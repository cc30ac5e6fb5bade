#include "bus_costs_network.hpp"

#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace pocd::benchmark {

std::string enter_own_network(double link_mbit) {
  if (unshare(CLONE_NEWNET) != 0) return "no right to make a network namespace";
  std::string commands =
      "PATH=$PATH:/usr/sbin:/sbin; ip link set lo up && ip link set lo multicast on && "
      "ip route add 224.0.0.0/4 dev lo";
  if (link_mbit > 0.0) {
    std::ostringstream limit;
    // Packets on loopback have up to 64 KB. A queue of 100 ms and more is what access points have.
    limit << " && tc qdisc add dev lo root tbf rate " << link_mbit
          << "mbit burst 128kb latency 100ms";
    commands += limit.str();
  }
  if (std::system(commands.c_str()) != 0) return "the loopback interface could not be set up";
  return "";
}

std::uint64_t loopback_bytes() {
  std::ifstream in("/proc/net/dev");
  for (std::string line; std::getline(in, line);) {
    const auto at = line.find("lo:");
    if (at != std::string::npos) return std::stoull(line.substr(at + 3));
  }
  return 0;
}

ProcessCost process_cost(pid_t pid) {
  const std::string folder = pid == 0 ? "/proc/self/" : "/proc/" + std::to_string(pid) + "/";
  ProcessCost cost;
  std::string stat;
  std::getline(std::ifstream(folder + "stat"), stat);
  std::istringstream fields(stat.substr(stat.rfind(')') + 1));  // the name may hold spaces
  std::string field;
  double user = 0.0, system = 0.0;
  for (int i = 3; i <= 13; ++i) fields >> field;
  fields >> user >> system;
  cost.cpu_s = (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
  double pages = 0.0, resident = 0.0;
  std::ifstream(folder + "statm") >> pages >> resident;
  cost.memory_mb = resident * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
  return cost;
}

}  // namespace pocd::benchmark
