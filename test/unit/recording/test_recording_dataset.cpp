#include <gtest/gtest.h>

#include "pocd/common/check.hpp"
#include "recorded_run.hpp"

namespace pocd::recording {
namespace {

constexpr StampNs kStart = 5'000'000'000;

void write_run(const std::filesystem::path& file, StampNs start_ns, int frames,
               bool mounts = true) {
  RecordedRun run(file);
  if (mounts) run.write_mounts(start_ns - 1000);
  for (int i = 0; i < frames; ++i) {
    run.write_frame("b", start_ns + i * kPeriod);
    run.write_frame("a", start_ns + i * kPeriod + kPeriod / 2);
  }
  run.writer().close();
}

TEST(RecordingDataset, MakesFramesOfAllRobotsInTheOrderOfStamps) {
  const TemporaryFolder folder;
  write_run(folder / "run.mcap", kStart, 20);
  const auto reader = open_recorded(options_for({folder / "run.mcap"}));
  EXPECT_EQ(reader->size(), 40u);
  const std::vector<Frame> frames = frames_of(*reader);
  EXPECT_TRUE(reader->problems().empty()) << reader->problems()[0];
  ASSERT_EQ(frames.size(), 40u);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = frames[i];
    EXPECT_EQ(frame.robot, i % 2 == 0 ? "b" : "a");
    EXPECT_EQ(frame.stamp_ns, kStart + static_cast<StampNs>(i) * kPeriod / 2);
    EXPECT_EQ(frame.sequence, i / 2);
    EXPECT_FLOAT_EQ(frame.depth_m.at<float>(3, 3), 1.5f);
    EXPECT_EQ(frame.labels.at<std::uint16_t>(3, 3), 7);
    const Eigen::Vector3d expected =
        pose_at(frame.robot, frame.stamp_ns).position + Eigen::Vector3d(0, 0, 0.5);
    EXPECT_EQ(frame.T_W_C.translation(), expected);  // an exact stamp is not interpolated
  }
}

TEST(RecordingDataset, GoesOnAcrossSplitsAndMovesLaterRuns) {
  const TemporaryFolder folder;
  write_run(folder / "run_0.mcap", kStart, 5);
  write_run(folder / "run_1.mcap", kStart + 5 * kPeriod, 5, false);  // the mounts are in the first
  const auto split = open_recorded(options_for({folder.path()}));
  const std::vector<Frame> frames = frames_of(*split);
  ASSERT_EQ(frames.size(), 20u);
  EXPECT_EQ(frames.back().stamp_ns, kStart + 9 * kPeriod + kPeriod / 2);

  write_run(folder / "other.mcap", kStart, 5);
  const auto runs = open_recorded(options_for({folder / "run_0.mcap", folder / "other.mcap"}));
  const std::vector<Frame> both = frames_of(*runs);
  ASSERT_EQ(both.size(), 20u);
  for (std::size_t i = 1; i < both.size(); ++i) EXPECT_GT(both[i].stamp_ns, both[i - 1].stamp_ns);
  EXPECT_EQ(both[10].stamp_ns, both[9].stamp_ns + 1'000'000'000);
}

TEST(RecordingDataset, BadMessagesCostTheirFrameAndAreNamed) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  run.write_mounts(kStart - 1000);
  for (int i = 0; i < 10; ++i) {
    const StampNs stamp_ns = kStart + i * kPeriod;
    if (i == 3) {
      const cv::Mat depth(6, 8, CV_8UC3);
      run.write("/a/depth/image_raw", stamp_ns, image_payload(stamp_ns, "a/camera", "rgb8", depth));
    } else if (i == 4) {
      run.write("/a/depth/image_raw", stamp_ns, Bytes{0, 1, 0, 0, 9, 9});
    } else {
      run.write_frame("a", stamp_ns, i != 6);
    }
    run.write_frame("b", stamp_ns);
  }
  run.writer().close();
  const auto reader = open_recorded(options_for({folder / "run.mcap"}));
  const std::vector<Frame> frames = frames_of(*reader);
  EXPECT_EQ(frames.size(), 18u);
  ASSERT_EQ(reader->problems().size(), 3u);
  EXPECT_NE(reader->problems()[0].find(
                "/a/depth/image_raw at 5300000000 ns: unknown_encoding: encoding \"rgb8\""),
            std::string::npos);
  EXPECT_NE(reader->problems()[1].find("bytes of payload are missing"), std::string::npos);
  EXPECT_NE(reader->problems()[2].find("rt/a/segmentation: no_mask"), std::string::npos);
  EXPECT_EQ(reader->skipped(), 2u);
  int without_labels = 0;
  for (const Frame& frame : frames) without_labels += frame.labels.empty();
  EXPECT_EQ(without_labels, 1);
}

// Every transform of a message is judged by itself, as on the bus, and told to every robot.
TEST(RecordingDataset, OneBadTransformCostsTheOthersOfItsMessageNothing) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  PoseQuaternion zero;
  zero.rotation.coeffs().setZero();
  run.write("/tf_static", kStart - 2000,
            tf_payload({{"a/camera", "a/lens", 0, zero},
                        {"a/base", "a/camera", 0, PoseQuaternion{}},
                        {"b/mast", "b/camera", 0, PoseQuaternion{}}}));
  run.write(
      "/tf_static", kStart - 1000,
      tf_payload({{"b/base", "b/camera", 0, PoseQuaternion{}},  // another parent: said, and used
                  {"a/camera", "a/camera", 0, PoseQuaternion{}}}));
  for (int i = 0; i < 5; ++i) {
    run.write_frame("b", kStart + i * kPeriod);
    run.write_frame("a", kStart + i * kPeriod + kPeriod / 2);
  }
  run.writer().close();
  const auto reader = open_recorded(options_for({folder / "run.mcap"}));
  EXPECT_EQ(frames_of(*reader).size(), 10u);
  ASSERT_EQ(reader->problems().size(), 3u);
  EXPECT_NE(reader->problems()[0].find(
                "/tf_static at 4999998000 ns: non_unit_quaternion: quaternion has length 0"),
            std::string::npos);
  EXPECT_NE(reader->problems()[1].find("frame \"b/camera\" had parent \"b/mast\""),
            std::string::npos);
  EXPECT_NE(reader->problems()[2].find("are both \"a/camera\""), std::string::npos);
  EXPECT_EQ(reader->skipped(), 2u);
}

// The rest of the run is there after one odometry stamp of 2038, and the next run does not begin
// after one depth image of 2038.
TEST(RecordingDataset, OneStampFarInTheFutureCostsTenFrames) {
  const TemporaryFolder folder;
  constexpr StampNs kFar = 2'147'483'647'000'000'000;
  RecordedRun run(folder / "run_0.mcap");
  run.write_mounts(kStart - 1000);
  for (int i = 0; i < 40; ++i) {
    run.write_frame("a", kStart + i * kPeriod);
    if (i == 9) {
      run.write("/a/odom", kStart + i * kPeriod + 50'000'000,
                odometry_payload(kFar, "map", "a/base", PoseQuaternion{}));
    }
    if (i == 24) {
      run.write("/a/depth/image_raw", kStart + i * kPeriod + 50'000'000,
                image_payload(kFar, "a/camera", "16UC1", cv::Mat(6, 8, CV_16UC1, cv::Scalar(1))));
    }
  }
  run.writer().close();
  write_run(folder / "run_1.mcap", kStart + 40 * kPeriod, 5, true);
  const auto reader = open_recorded(options_for({folder / "run_0.mcap", folder / "run_1.mcap"}));
  std::vector<Frame> frames;
  for (Frame& frame : frames_of(*reader)) {
    if (frame.robot == "a") frames.push_back(std::move(frame));
  }
  // Of the poses ten: the tenth is there only after its image.
  ASSERT_EQ(frames.size(), 45u - StampOrder::kAgreeing - (StampOrder::kAgreeing - 1));
  EXPECT_EQ(frames.back().stamp_ns, kStart + 44 * kPeriod + kPeriod / 2);
  int restarts = 0;
  for (const std::string& problem : reader->problems()) {
    restarts += problem.find("starts anew") != std::string::npos;
  }
  EXPECT_EQ(restarts, 2);
}

TEST(RecordingDataset, AsLiveGivesWhatTheComponentTook) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  run.write_mounts(kStart - 1000);
  std::vector<std::pair<std::string, StampNs>> expected;
  for (int i = 0; i < 10; ++i) {
    for (const std::string robot : {"a", "b"}) run.write_frame(robot, kStart + i * kPeriod);
  }
  // Two frames of a dropped, and one of b later than it should be.
  std::uint64_t order = 0;
  for (int i = 0; i < 10; ++i) {
    const StampNs stamp_ns = kStart + i * kPeriod;
    const bool dropped = i == 2 || i == 3;
    run.write_record("a", stamp_ns, dropped ? 0 : ++order, i != 5);
    if (!dropped) expected.emplace_back("a", stamp_ns);
    const StampNs late_ns = i == 6 ? stamp_ns + kPeriod : i == 7 ? stamp_ns - kPeriod : stamp_ns;
    run.write_record("b", late_ns, ++order, true);
    expected.emplace_back("b", late_ns);
  }
  run.write_record("a", kStart + 99 * kPeriod, ++order, true);  // never recorded
  run.writer().close();
  DatasetOptions options = options_for({folder / "run.mcap"});
  options.as_live = true;
  const auto reader = open_recorded(options);
  const std::vector<Frame> frames = frames_of(*reader);
  ASSERT_EQ(frames.size(), expected.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].robot, expected[i].first) << i;
    EXPECT_EQ(frames[i].stamp_ns, expected[i].second) << i;
    EXPECT_EQ(frames[i].labels.empty(),
              frames[i].robot == "a" && frames[i].stamp_ns == kStart + 5 * kPeriod);
  }
  ASSERT_EQ(reader->problems().size(), 1u);
  EXPECT_NE(reader->problems()[0].find("1 frames were processed live"), std::string::npos);

  write_run(folder / "without.mcap", kStart, 3);
  options.inputs = {folder / "without.mcap"};
  EXPECT_THROW(open_recorded(options), InputError);
}

TEST(RecordingDataset, SaysWhatItLooksFor) {
  const TemporaryFolder folder;
  McapWriter(folder / "empty.mcap").close();
  try {
    open_recorded(options_for({folder / "empty.mcap"}));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/{robot}/depth/image_raw"), std::string::npos);
  }
}

}  // namespace
}  // namespace pocd::recording
