// A whole run of player and component, beside the offline run of the same frames.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

#include "bus_harness.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/config/run_summary.hpp"

namespace pocd {

/// What pocd_map makes of these frames.
inline RunSummary offline_run(const std::string& input, const std::filesystem::path& output,
                              const std::vector<std::string>& more = {}) {
  std::vector<std::string> command{bin("pocd_map"),
                                   "--dataset",
                                   "sim",
                                   "--input",
                                   input,
                                   "--config",
                                   source("config/simulated.yaml"),
                                   "--output",
                                   output.string()};
  command.insert(command.end(), more.begin(), more.end());
  const CommandResult result = run_command(command);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  RunSummary summary;
  load_config(summary, {output / "summary.yaml"});
  return summary;
}

/// Plays to the end, then ends the component in order; both have to succeed. What it said.
/// `before_end`: while the component is still there, which is soon gone after a run this short.
inline std::string play_and_end(Process& node, const std::vector<std::string>& play,
                                const std::function<void()>& before_end = {}) {
  const CommandResult played = run_command(play);
  EXPECT_EQ(played.exit_code, 0) << played.err;
  if (before_end) before_end();
  node.signal(SIGINT);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  return ended.err;
}

/// The same, with a mirror beside it that has to end with the map of the offline run.
inline std::string play_and_compare(const TestDomain& domain, Process& node,
                                    const std::vector<std::string>& play, const RunSummary& offline,
                                    const std::vector<std::string>& mirror_more = {},
                                    const std::function<void()>& before_end = {}) {
  std::vector<std::string> follow{bin("pocd_mirror"), "--until-end", "--timeout", "300",
                                  "--domain",         domain.text()};
  follow.insert(follow.end(), mirror_more.begin(), mirror_more.end());
  Process mirror(follow);
  // A run this short could be over before the mirror has heard of the node.
  EXPECT_TRUE(eventually([&] {
    return mirror.err().find("in step with publisher") != std::string::npos;
  })) << mirror.err();
  const std::string said = play_and_end(node, play, before_end);
  const CommandResult mirrored = mirror.wait();
  EXPECT_EQ(mirrored.exit_code, 0) << mirrored.err;
  EXPECT_NE(mirrored.out.find("digest " + offline.map_digest), std::string::npos)
      << mirrored.out << mirrored.err << "offline " << offline.map_digest;
  return said;
}

/// Takes samples as they come, from a thread of its own, like a tool does. (Who reads at the end
/// only finds a dispose in the place of the state before it: topics keep the last sample.)
class Taker {
 public:
  ~Taker() { stop(); }
  /// For the readers.
  dds::Wakeup& wakeup() { return wakeup_; }
  /// `take` takes all there is.
  void start(std::function<void()> take) {
    take_ = std::move(take);
    thread_ = std::thread([this] {
      while (!stopping_) {
        wakeup_.wait_for(std::chrono::milliseconds(20));
        take_();
      }
    });
  }
  /// Everything that has arrived is taken; what `take` writes may be looked at from then on.
  void stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wakeup_.wake();
    thread_.join();
    take_();
  }

 private:
  dds::Wakeup wakeup_;
  std::function<void()> take_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace pocd
