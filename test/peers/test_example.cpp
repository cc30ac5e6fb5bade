// The example of docs/subscribing.md, built as its reader would: outside of the workspace, against
// the installed prefix; and run beside a real component.
#include <gtest/gtest.h>

#include <algorithm>

#include "bus_harness.hpp"

namespace pocd {
namespace {

/// The installed example, in a build of its own that lasts for all tests.
std::string built_lane_watch() {
  static const TemporaryFolder folder;
  const std::string prefix = POCD_BIN_DIR "/..", build = (folder.path() / "build").string();
  const CommandResult configured =
      run_command({POCD_CMAKE, "-S", prefix + "/share/pocd_dds/examples/lane_watch", "-B", build,
                   "-DCMAKE_PREFIX_PATH=" + prefix, "-DCMAKE_CXX_COMPILER_LAUNCHER=" POCD_LAUNCHER,
                   "-DCMAKE_CXX_FLAGS=" POCD_CXX_FLAGS});
  EXPECT_EQ(configured.exit_code, 0) << configured.err;
  const CommandResult built = run_command({POCD_CMAKE, "--build", build});
  EXPECT_EQ(built.exit_code, 0) << built.out << built.err;
  return build + "/lane_watch";
}

struct Lanes {
  std::unique_ptr<Process> start(const std::vector<std::string>& lane) const {
    std::vector<std::string> command{program, domain.text(), "0.6"};
    command.insert(command.end(), lane.begin(), lane.end());
    return std::make_unique<Process>(command);
  }
  const std::string program = built_lane_watch();
  const TestDomain domain;
};

bool says(const Process& process, const std::string& words, std::size_t n = 1) {
  return eventually([&] { return count_of(process.out(), words) >= n; });
}

TEST(Example, LaneWatchSeesWhatComesAndGoes) {
  const std::string text = read_text(source("pocd_dds/examples/lane_watch/lane_watch.cpp"));
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 60) << "is to be read at a glance";
  const Lanes lanes;
  ASSERT_FALSE(HasFailure());
  const TestDomain& domain = lanes.domain;
  // Past the box in the north, that is gone on the second drive, around a corner; past the one in
  // the south, that stays; and where nothing ever stands.
  const auto north = lanes.start({"-2", "0.5", "-2", "2", "0.5", "2"});
  const auto south = lanes.start({"-2", "-2", "2", "-2"});
  const auto empty = lanes.start({"-1", "0", "0.5", "0"});
  ASSERT_TRUE(says(*south, "no component")) << south->out();
  Process killed(node_command(domain, {"--lossless"}));
  ASSERT_EQ(run_command(play_command(domain)).exit_code, 0);
  EXPECT_TRUE(says(*north, "no longer blocked by")) << north->out();
  EXPECT_TRUE(says(*north, "removed: ")) << north->out();
  EXPECT_TRUE(says(*south, "blocked by box")) << south->out();
  // Objects and events are two topics: the event of the box may be the first line.
  EXPECT_LT(north->out().find("blocked by box"), north->out().find("no longer blocked by"))
      << north->out();
  EXPECT_NE(north->out().find(": 0 on the lane, 0 unknown"), std::string::npos) << north->out();

  // A component that is killed and starts again has looked at nothing yet: the lane is not free.
  killed.signal(SIGKILL);
  killed.wait();
  EXPECT_TRUE(says(*south, "no component", 2)) << south->out();
  Process node(node_command(domain, {"--lossless"}));
  ASSERT_EQ(run_command(play_command(domain)).exit_code, 0);
  EXPECT_TRUE(says(*south, "unknown since the component restarted: box")) << south->out();
  EXPECT_TRUE(says(*south, "\nblocked by box", 2)) << south->out();
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
  EXPECT_TRUE(says(*south, "no component", 3)) << south->out();
  EXPECT_EQ(south->out().find("no longer"), std::string::npos) << south->out();
  EXPECT_EQ(empty->out().find("blocked"), std::string::npos) << empty->out();
}

TEST(Example, LaneWatchCallsUnknownWhatARestartedNodeRemembers) {
  const Lanes lanes;
  ASSERT_FALSE(HasFailure());
  const TemporaryFolder folder;
  const std::vector<std::string> memory{"--lossless", "--set",
                                        "node.memory.folder=" + folder.path().string()};
  const auto south = lanes.start({"-2", "-2", "2", "-2"});
  {
    Process first(node_command(lanes.domain, memory));
    ASSERT_EQ(run_command(play_command(lanes.domain)).exit_code, 0);
    ASSERT_TRUE(says(*south, "blocked by box")) << south->out();
    first.signal(SIGINT);
    ASSERT_EQ(first.wait().exit_code, 0);
  }
  // The box is known, but no robot has looked: unknown, although nothing drives.
  Process second(node_command(lanes.domain, memory));
  EXPECT_TRUE(says(*south, "unknown since the component restarted: box")) << south->out();
  EXPECT_EQ(count_of(south->out(), "blocked by box"), 1u) << south->out();
  ASSERT_EQ(run_command(play_command(lanes.domain)).exit_code, 0);
  EXPECT_TRUE(says(*south, "\nblocked by box", 2)) << south->out();
  EXPECT_EQ(south->out().find("no longer"), std::string::npos) << south->out();
  second.signal(SIGINT);
  EXPECT_EQ(second.wait().exit_code, 0);
}

}  // namespace
}  // namespace pocd
