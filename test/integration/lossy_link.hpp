// Two hosts on one machine with a cable between them that loses packets.
#pragma once

#include <sched.h>

#include <cmath>
#include <optional>
#include <sstream>

#include "bus_harness.hpp"

namespace pocd {

/// This process and all it starts from here on is one host, what over_there() runs the other. Each
/// drops the given share of the packets that come in, evenly, so that a short test has losses, too.
/// Needs the rights of root and the commands ip and iptables; problem() says what is missing.
class LossyLink {
 public:
  explicit LossyLink(double loss) {
    if (unshare(CLONE_NEWNET) != 0) {
      problem_ = "no right to make a network namespace";
      return;
    }
    other_.emplace(
        std::vector<std::string>{"/usr/bin/unshare", "-n", "/usr/bin/sleep", "infinity"});
    const auto name = [](pid_t pid) {
      std::error_code error;
      return std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/ns/net", error);
    };
    const auto ours = name(getpid());
    if (!eventually([&] { return !name(other_->pid()).empty() && name(other_->pid()) != ours; })) {
      problem_ = "no second network namespace";
      return;
    }
    const std::string pid = std::to_string(other_->pid());
    here("ip link add pocd0 type veth peer name pocd1 netns " + pid);
    for (const bool there : {false, true}) {
      const std::string device = there ? "pocd1" : "pocd0", host = there ? "2" : "1";
      const auto run = [&](const std::string& text) { there ? this->there(text) : here(text); };
      run("ip link set lo up");
      run("ip addr add 10.77.0." + host + "/24 dev " + device);
      run("ip link set " + device + " up");
      run("ip route add 224.0.0.0/4 dev " + device);
      std::ostringstream rule;
      rule << "iptables -t raw -I PREROUTING -i " << device << " -m statistic --mode nth --every "
           << std::lround(1.0 / loss) << " --packet 0 -j DROP";
      run(rule.str());
    }
  }

  const std::string& problem() const { return problem_; }

  std::vector<std::string> over_there(const std::vector<std::string>& command) const {
    std::vector<std::string> all{"/usr/bin/nsenter", "-t", std::to_string(other_->pid()), "-n"};
    all.insert(all.end(), command.begin(), command.end());
    return all;
  }
  /// Packets that the other host has lost.
  std::uint64_t lost_there() const {
    std::istringstream table(
        run_command(over_there({"/bin/sh", "-c",
                                "PATH=$PATH:/usr/sbin:/sbin iptables -t raw -nvxL PREROUTING"}))
            .out);
    std::string line;
    while (std::getline(table, line)) {
      std::istringstream words(line);
      std::uint64_t packets = 0;
      if (line.find("DROP") != std::string::npos && words >> packets) return packets;
    }
    return 0;
  }

 private:
  void here(const std::string& text) { check({"/bin/sh", "-c", kPath + text}, text); }
  void there(const std::string& text) { check(over_there({"/bin/sh", "-c", kPath + text}), text); }
  void check(const std::vector<std::string>& command, const std::string& text) {
    const CommandResult result = run_command(command);
    if (result.exit_code != 0 && problem_.empty()) problem_ = text + ": " + result.err;
  }

  static inline const std::string kPath = "PATH=$PATH:/usr/sbin:/sbin ";
  std::string problem_;
  std::optional<Process> other_;
};

}  // namespace pocd
