// pocd_map on good input: what it writes, and that it writes the same bytes every time.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "pocd/config/config_io.hpp"
#include "pocd/output/run_summary.hpp"
#include "small_rgbd.hpp"

namespace pocd {
namespace {

const std::string kCommand = std::string(POCD_BIN_DIR) + "/pocd_map";
const std::filesystem::path kRoot = POCD_SOURCE_DIR;

class PocdMap : public testing::Test {
 protected:
  std::vector<std::string> arguments(const std::string& output,
                                     const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{kCommand,
                                 "--dataset",
                                 "rgbd",
                                 "--config",
                                 (kRoot / "config/redkitchen.yaml").string(),
                                 "--output",
                                 (folder_.path() / output).string(),
                                 "--input",
                                 (folder_.path() / "in").string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  RunSummary summary(const std::string& output) const {
    RunSummary result;
    load_config(result, {folder_.path() / output / "summary.yaml"});
    return result;
  }
  std::string text(const std::string& output, const std::string& file) const {
    return read_text(folder_.path() / output / file);
  }
  std::string first_line(const std::string& output, const std::string& file) const {
    const std::string all = text(output, file);
    return all.substr(0, all.find('\n'));
  }

  TemporaryFolder folder_;
};

TEST_F(PocdMap, WritesEveryFile) {
  write_small_rgbd(folder_.path() / "in", 6);
  const CommandResult result = run_command(arguments("out"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out.rfind("6 frames, 0 skipped, 0 refused; ", 0), 0u) << result.out;

  EXPECT_EQ(
      first_line("out", "objects.csv"),
      "id,class,class_name,stationarity_class,x,y,z,yaw,size_x,size_y,size_z,box_z,stationarity,"
      "alpha,beta,mu,sigma,first_seen_ns,last_seen_ns,observations,last_robot");
  EXPECT_EQ(first_line("out", "events.csv").rfind("sequence,stamp_ns,kind,object_id,", 0), 0u);
  EXPECT_EQ(first_line("out", "timing.csv"), "frame,stamp_ns,robot,stage,wall_ms,cpu_ms");
  EXPECT_EQ(first_line("out", "map.ply"), "ply");
  EXPECT_FALSE(cv::imread((folder_.path() / "out/birdseye.png").string()).empty());

  const RunSummary s = summary("out");
  EXPECT_EQ(s.frames, 6u);
  EXPECT_EQ(s.skipped, 0u);
  EXPECT_FALSE(s.stopped_early);
  EXPECT_EQ(s.dataset, "rgbd");
  EXPECT_EQ(s.map_digest.size(), 32u);
  EXPECT_GT(s.map_blocks, 0u);
  EXPECT_EQ(s.config.map.max_depth_m, 4.0);  // redkitchen.yaml's
}

TEST_F(PocdMap, SameBytesForEveryNumberOfThreads) {
  write_small_rgbd(folder_.path() / "in", 8);
  ASSERT_EQ(run_command(arguments("one", {"--threads", "1"})).exit_code, 0);
  ASSERT_EQ(run_command(arguments("two", {"--threads", "2"})).exit_code, 0);
  for (const char* file : {"map.ply", "objects.csv", "events.csv", "birdseye.png"}) {
    EXPECT_TRUE(text("one", file) == text("two", file)) << file;
  }
  EXPECT_EQ(summary("one").map_digest, summary("two").map_digest);
  EXPECT_EQ(summary("two").config.threads, 2);
}

TEST_F(PocdMap, SeveralInputsAreOneRun) {
  write_small_rgbd(folder_.path() / "in", 3);
  write_small_rgbd(folder_.path() / "in2", 4);
  const CommandResult result =
      run_command(arguments("out", {"--input", (folder_.path() / "in2").string()}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(summary("out").frames, 7u);
  EXPECT_EQ(summary("out").inputs.size(), 2u);
}

TEST_F(PocdMap, MaxFramesStopsEarly) {
  write_small_rgbd(folder_.path() / "in", 5);
  ASSERT_EQ(run_command(arguments("out", {"--max-frames", "2"})).exit_code, 0);
  EXPECT_EQ(summary("out").frames, 2u);
  EXPECT_TRUE(summary("out").stopped_early);
}

TEST_F(PocdMap, SummaryIsAConfigurationThatGivesTheSameMap) {
  write_small_rgbd(folder_.path() / "in", 4);
  ASSERT_EQ(run_command(arguments("out", {"--set", "map.voxel_size_m=0.1"})).exit_code, 0);
  std::ofstream(folder_.path() / "effective.yaml") << dump_config(summary("out").config);
  std::vector<std::string> again = arguments("again");
  again[4] = (folder_.path() / "effective.yaml").string();
  const CommandResult result = run_command(again);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(summary("again").map_digest, summary("out").map_digest);
}

TEST_F(PocdMap, SigintStopsAndWritesWhatItHas) {
  write_small_rgbd(folder_.path() / "in", 20);
  std::vector<std::string> many = arguments("out");
  for (int i = 0; i < 500; ++i) {  // more than is done before the signal arrives
    many.insert(many.end(), {"--input", (folder_.path() / "in").string()});
  }
  Process process(many);
  const std::filesystem::path timing = folder_.path() / "out/timing.csv";
  for (int i = 0; i < 3000 && !std::filesystem::exists(timing); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  process.signal(SIGINT);
  const CommandResult result = process.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(summary("out").stopped_early);
  EXPECT_LT(summary("out").frames, 20u * 501u);
}

}  // namespace
}  // namespace pocd
