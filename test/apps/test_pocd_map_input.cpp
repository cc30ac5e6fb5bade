// pocd_map on bad input: exit code, the one line that says what is wrong, and what it goes on past.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "pocd/config/config_io.hpp"
#include "pocd/config/run_summary.hpp"
#include "small_rgbd.hpp"

namespace pocd {
namespace {

const std::string kCommand = std::string(POCD_BIN_DIR) + "/pocd_map";
const std::filesystem::path kRoot = POCD_SOURCE_DIR;

long lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class PocdMapInput : public testing::Test {
 protected:
  PocdMapInput() { write_small_rgbd(in_, 6); }

  CommandResult run(const std::string& config, const std::filesystem::path& input,
                    const std::string& dataset = "rgbd") const {
    return run_command({kCommand, "--dataset", dataset, "--input", input.string(), "--config",
                        config, "--output", out_.string()});
  }
  CommandResult run() const { return run(kGoodConfig, in_); }

  void expect_one_line_failure(const CommandResult& result, const std::string& part) const {
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(lines(result.err), 1) << result.err;
    EXPECT_EQ(result.err.rfind("pocd_map: ", 0), 0u) << result.err;
    EXPECT_TRUE(contains(result.err, part)) << result.err;
  }

  /// The run goes on, skips one frame, and says so in one line that has all parts.
  void expect_one_skipped(const CommandResult& result,
                          const std::vector<std::string>& parts) const {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(lines(result.err), 1) << result.err;
    EXPECT_EQ(result.err.rfind("skipped: ", 0), 0u) << result.err;
    for (const std::string& part : parts) EXPECT_TRUE(contains(result.err, part)) << result.err;
    EXPECT_TRUE(contains(result.out, "5 frames, 1 skipped")) << result.out;
    RunSummary summary;
    load_config(summary, {out_ / "summary.yaml"});
    EXPECT_EQ(summary.frames, 5u);
    EXPECT_EQ(summary.skipped, 1u);
  }

  const std::string kGoodConfig = (kRoot / "config/redkitchen.yaml").string();
  TemporaryFolder folder_;
  std::filesystem::path in_ = folder_.path() / "in";
  std::filesystem::path out_ = folder_.path() / "out";
};

TEST_F(PocdMapInput, HelpHasAnExample) {
  const CommandResult result = run_command({kCommand, "--help"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(contains(result.out, "Example: pocd_map "));
}

TEST_F(PocdMapInput, UsageErrorsEndWithTwo) {
  EXPECT_EQ(run_command({kCommand}).exit_code, 2);
  const CommandResult unknown = run_command({kCommand, "--inptu", "a"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err, "");
  EXPECT_EQ(unknown.out, "");
}

TEST_F(PocdMapInput, EveryInvalidConfigEndsWithTwoAndNamesIt) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(kRoot / "test/data/invalid/config")) {
    const CommandResult result = run(entry.path().string(), in_);
    EXPECT_EQ(result.exit_code, 2) << entry.path();
    EXPECT_EQ(result.err.rfind("pocd_map: ", 0), 0u) << result.err;
    EXPECT_FALSE(std::filesystem::exists(out_)) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 20);
}

TEST_F(PocdMapInput, SeveralConfigErrorsAreListedAtOnce) {
  const CommandResult result =
      run((kRoot / "test/data/invalid/config/three_errors.yaml").string(), in_);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(lines(result.err), 4) << result.err;
  EXPECT_TRUE(contains(result.err, "configuration has 3 errors:"));
}

TEST_F(PocdMapInput, UnknownFormatIsNamed) {
  const CommandResult result = run(kGoodConfig, in_, "rosbag");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(contains(result.err, "--dataset: rosbag not in {torwic,toycar,rgbd,pcd,sim,mcap}"))
      << result.err;
}

TEST_F(PocdMapInput, MissingFolderIsNamed) {
  expect_one_line_failure(run(kGoodConfig, folder_.path() / "absent"),
                          (folder_.path() / "absent").string());
}

TEST_F(PocdMapInput, EmptyFolderIsNamed) {
  std::filesystem::create_directories(folder_.path() / "empty");
  expect_one_line_failure(run(kGoodConfig, folder_.path() / "empty"),
                          (folder_.path() / "empty").string());
}

TEST_F(PocdMapInput, OutputThatIsAFileIsNamed) {
  std::ofstream(out_) << "in the way";
  expect_one_line_failure(run(), out_.string());
}

// Labels from 10 on are of class 2, which the configuration does not have; they are signed here, as
// some exporters write them.
TEST_F(PocdMapInput, IdsThatAreNoClassAreNamed) {
  const auto clouds = folder_.path() / "clouds";
  std::filesystem::create_directories(clouds);
  std::ofstream out(clouds / "a.pcd");
  out << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F I\nCOUNT 1 1 1 "
         "1\nWIDTH 8\nHEIGHT 6\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 48\nDATA ascii\n";
  for (int v = 0; v < 6; ++v) {
    for (int u = 0; u < 8; ++u) out << "0 0 1.5 " << (u < 2 ? 17 : 1) << '\n';
  }
  out.close();
  const CommandResult result =
      run_command({kCommand, "--dataset", "pcd", "--input", clouds.string(), "--config",
                   kGoodConfig, "--camera", "8,6,10,10,3.5,2.5", "--camera-pose", "0,0,0,0,0,0,1",
                   "--output", out_.string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err,
            "unlisted_class: ids that are no class of classes.list and so background: 2; 25 % of "
            "the pixels\n");
}

TEST_F(PocdMapInput, TruncatedDepthImageIsSkipped) {
  const std::filesystem::path file = frame_file(in_, 2, ".depth.png");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  expect_one_skipped(run(), {file.filename().string()});
}

TEST_F(PocdMapInput, EmptyDepthImageIsSkipped) {
  std::filesystem::resize_file(frame_file(in_, 2, ".depth.png"), 0);
  expect_one_skipped(run(), {"frame-000002.depth.png"});
}

TEST_F(PocdMapInput, ColourImageAsDepthIsSkipped) {
  std::filesystem::copy_file(frame_file(in_, 3, ".color.png"), frame_file(in_, 3, ".depth.png"),
                             std::filesystem::copy_options::overwrite_existing);
  expect_one_skipped(run(), {"frame-000003.depth.png"});
}

TEST_F(PocdMapInput, DepthImageOfAnotherSizeIsSkipped) {
  cv::imwrite(frame_file(in_, 1, ".depth.png").string(), cv::Mat(30, 40, CV_16UC1, 1000));
  expect_one_skipped(run(), {"frame-000001"});
}

TEST_F(PocdMapInput, PoseWithNanIsSkipped) {
  std::ofstream(frame_file(in_, 4, ".pose.txt")) << "0 0 1 nan\n-1 0 0 0\n0 -1 0 1\n0 0 0 1\n";
  expect_one_skipped(run(), {"frame-000004.pose.txt"});
}

TEST_F(PocdMapInput, ShortPoseFileIsSkipped) {
  std::ofstream(frame_file(in_, 4, ".pose.txt")) << "0 0 1 0\n-1 0 0\n";
  expect_one_skipped(run(), {"frame-000004.pose.txt"});
}

TEST_F(PocdMapInput, PoseThatIsNoRotationIsSkipped) {
  std::ofstream(frame_file(in_, 4, ".pose.txt")) << "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n";
  expect_one_skipped(run(), {"frame-000004"});
}

TEST_F(PocdMapInput, MissingPoseIsSkipped) {
  std::filesystem::remove(frame_file(in_, 5, ".pose.txt"));
  expect_one_skipped(run(), {"frame-000005", "pose"});
}

TEST_F(PocdMapInput, NoGoodFrameIsAFailure) {
  for (int i = 0; i < 6; ++i) std::filesystem::resize_file(frame_file(in_, i, ".depth.png"), 10);
  const CommandResult result = run();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(lines(result.err), 7) << result.err;
  EXPECT_TRUE(contains(result.err, "pocd_map: no good frame in the inputs (6 skipped)"));
}

}  // namespace
}  // namespace pocd
