// pocd_map --memory, pocd_memory, pocd_history, as a user runs them.
#include <gtest/gtest.h>

#include <thread>

#include "pocd/common/random.hpp"
#include "run_command.hpp"

namespace pocd {
namespace {

const std::filesystem::path kRoot = POCD_SOURCE_DIR;

std::string program(const std::string& name) { return std::string(POCD_BIN_DIR) + "/" + name; }

class Memory : public testing::Test {
 protected:
  std::vector<std::string> map_command(const std::string& output,
                                       const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{program("pocd_map"),
                                 "--dataset",
                                 "sim",
                                 "--input",
                                 (kRoot / "test/integration/recording/small_run.yaml").string(),
                                 "--config",
                                 (kRoot / "config/simulated.yaml").string(),
                                 "--output",
                                 (folder_.path() / output).string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::string memory() const { return (folder_.path() / "memory").string(); }
  std::string file(const std::string& output, const std::string& name) const {
    return read_text(folder_.path() / output / name);
  }
  CommandResult run(const std::string& name, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), program(name));
    return run_command(arguments);
  }
  static std::size_t lines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  TemporaryFolder folder_;
};

TEST_F(Memory, ARunThatIsKilledAndResumedWritesTheSameFiles) {
  const CommandResult whole = run_command(map_command("whole"));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  Random random(3);
  const std::vector<std::string> resumed =
      map_command("resumed", {"--memory", memory(), "--resume", "--memory-period", "0"});
  for (int kill = 0; kill < 6; ++kill) {
    Process process(resumed);
    std::this_thread::sleep_for(std::chrono::milliseconds(50 + random.below(400)));
    process.signal(SIGKILL);
    if (process.wait().exit_code == 0) break;
  }
  const CommandResult last = run_command(resumed);
  ASSERT_EQ(last.exit_code, 0) << last.err;
  for (const char* name : {"events.csv", "objects.csv", "map.ply"}) {
    EXPECT_EQ(file("whole", name), file("resumed", name)) << name;
  }
  EXPECT_EQ(whole.out.substr(0, whole.out.find('\n')), last.out.substr(0, last.out.find('\n')));
  const CommandResult verified = run("pocd_memory", {"verify", memory()});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_EQ(verified.out, "whole\n");
}

TEST_F(Memory, ASecondVisitGoesOnWithTheObjectsOfTheFirst) {
  ASSERT_EQ(run_command(map_command("first", {"--memory", memory()})).exit_code, 0);
  EXPECT_NE(file("first", "events.csv").find(",ADDED,"), std::string::npos);
  const std::string before = run("pocd_memory", {"info", memory()}).out;
  EXPECT_NE(before.find("ended_clean: true"), std::string::npos) << before;
  ASSERT_EQ(run_command(map_command("second", {"--memory", memory()})).exit_code, 0);
  const std::string after = run("pocd_memory", {"info", memory()}).out;
  EXPECT_EQ(before.substr(0, before.find('\n')), after.substr(0, after.find('\n'))) << "lineage";
  EXPECT_NE(after.find("run: 2"), std::string::npos) << after;
  // What was known is not added again.
  EXPECT_EQ(file("second", "events.csv").find(",ADDED,"), std::string::npos)
      << file("second", "events.csv");
  EXPECT_EQ(lines(file("second", "objects.csv")), lines(file("first", "objects.csv")));
}

TEST_F(Memory, HistoryAndCopies) {
  ASSERT_EQ(run_command(map_command("out", {"--memory", memory()})).exit_code, 0);
  const CommandResult events = run("pocd_history", {"events", memory()});
  ASSERT_EQ(events.exit_code, 0) << events.err;
  EXPECT_EQ(lines(events.out), lines(file("out", "events.csv")));
  EXPECT_NE(events.out.find(",found\n"), std::string::npos) << "ADDED ends with its arrival";
  const CommandResult early = run("pocd_history", {"at", memory(), "--time", "0.0"});
  EXPECT_EQ(early.out, "");
  const CommandResult end =
      run("pocd_history", {"at", memory(), "--time", "100000.0", "--format", "json"});
  EXPECT_EQ(end.out.rfind("[\n {\"sequence\": ", 0), 0u) << end.out;
  const CommandResult diff =
      run("pocd_history", {"diff", memory(), "--from", "0.0", "--to", "100000.0"});
  EXPECT_NE(diff.out.find(",ADDED,"), std::string::npos) << diff.out;
  const CommandResult life = run("pocd_history", {"object", memory(), "1"});
  EXPECT_EQ(life.exit_code, 0);
  EXPECT_EQ(run("pocd_history", {"at", memory(), "--time", "yesterday"}).exit_code, 1);
  EXPECT_EQ(run("pocd_history", {"at", memory()}).exit_code, 2);
  EXPECT_EQ(run("pocd_history", {"events", (folder_.path() / "nothing").string()}).exit_code, 1);

  const std::string copy = (folder_.path() / "copy").string();
  ASSERT_EQ(run("pocd_memory", {"backup", memory(), "--output", copy}).exit_code, 0);
  EXPECT_EQ(run("pocd_memory", {"verify", copy}).out, "whole\n");
  EXPECT_EQ(run("pocd_history", {"events", copy}).out, events.out);
  EXPECT_EQ(run("pocd_memory", {"compact", copy}).exit_code, 0);
  ASSERT_EQ(run("pocd_memory", {"export", copy, "--output", (folder_.path() / "export").string()})
                .exit_code,
            0);
  EXPECT_EQ(file("export", "events.csv"), file("out", "events.csv"));
  EXPECT_GT(file("export", "map.pocdmap").size(), 1000u);
}

TEST_F(Memory, AnotherVoxelSizeIsRefused) {
  ASSERT_EQ(run_command(map_command("out", {"--memory", memory(), "--max-frames", "5"})).exit_code,
            0);
  const CommandResult other =
      run_command(map_command("other", {"--memory", memory(), "--set", "map.voxel_size_m=0.2"}));
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("map.voxel_size_m"), std::string::npos) << other.err;
  EXPECT_EQ(run_command(map_command("x", {"--resume"})).exit_code, 2);
}

}  // namespace
}  // namespace pocd
