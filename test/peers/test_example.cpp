// The example of docs/subscribing.md, built as its reader would: outside of the workspace, against
// the installed prefix; and run beside a real component.
#include <gtest/gtest.h>

#include <algorithm>

#include "bus_harness.hpp"

namespace pocd {
namespace {

TEST(Example, LaneWatchSeesWhatComesAndGoes) {
  const std::string text = read_text(source("pocd_dds/examples/lane_watch/lane_watch.cpp"));
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 60) << "is to be read at a glance";
  const TemporaryFolder folder;
  const std::string prefix = POCD_BIN_DIR "/..", build = (folder.path() / "build").string();
  const CommandResult configured = run_command(
      {POCD_CMAKE, "-S", prefix + "/share/pocd_dds/examples/lane_watch", "-B", build,
       "-DCMAKE_PREFIX_PATH=" + prefix, "-DCMAKE_CXX_COMPILER_LAUNCHER=" POCD_LAUNCHER});
  ASSERT_EQ(configured.exit_code, 0) << configured.err;
  const CommandResult built = run_command({POCD_CMAKE, "--build", build});
  ASSERT_EQ(built.exit_code, 0) << built.out << built.err;

  const TestDomain domain;
  const auto start = [&](const std::vector<std::string>& lane) {
    std::vector<std::string> command{build + "/lane_watch", domain.text(), "0.6"};
    command.insert(command.end(), lane.begin(), lane.end());
    return std::make_unique<Process>(command);
  };
  // Past the box in the north, that is gone on the second drive, around a corner; past the one in
  // the south, that stays; and where nothing ever stands.
  const auto north = start({"-2", "0.5", "-2", "2", "0.5", "2"});
  const auto south = start({"-2", "-2", "2", "-2"});
  const auto empty = start({"-1", "0", "0.5", "0"});
  Process node(node_command(domain, {"--lossless"}));
  const CommandResult played = run_command(play_command(domain));
  ASSERT_EQ(played.exit_code, 0) << played.err;
  const auto says = [&](Process& process, const std::string& text) {
    return eventually([&] { return process.out().find(text) != std::string::npos; });
  };
  EXPECT_TRUE(says(*north, "no longer blocked by")) << north->out();
  EXPECT_TRUE(says(*north, "removed: ")) << north->out();
  EXPECT_TRUE(says(*south, "blocked by box")) << south->out();
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
  // Objects and events are two topics: the event of the box may be the first line.
  EXPECT_LT(north->out().find("blocked by box"), north->out().find("no longer blocked by"))
      << north->out();
  EXPECT_NE(north->out().find(", 0 left"), std::string::npos) << north->out();
  // Not when the component ends, either.
  EXPECT_EQ(south->out().find("no longer"), std::string::npos) << south->out();
  EXPECT_EQ(empty->out(), "");
}

}  // namespace
}  // namespace pocd
