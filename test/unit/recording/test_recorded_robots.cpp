// Recordings as robots really leave them: what the node's options do offline, and what is named.
#include <gtest/gtest.h>
#include <zstd.h>

#include "compression.hpp"
#include "pocd/common/check.hpp"
#include "pocd/recording/recording_files.hpp"
#include "pocd/recording/split_writer.hpp"
#include "recorded_run.hpp"

namespace pocd::recording {
namespace {

constexpr StampNs kBegin = 5'000'000'000;

bool says(const DatasetReader& reader, const std::string& part) {
  for (const std::string& problem : reader.problems()) {
    if (problem.find(part) != std::string::npos) return true;
  }
  return false;
}
std::string all_of(const DatasetReader& reader) {
  std::string text;
  for (const std::string& problem : reader.problems()) text += problem + "\n";
  return text;
}

/// Robot a only, with the given parts.
struct Parts {
  bool mounts = true, masks = true;
  int infos = 1000, frames = 20;
};
void write_a(RecordedRun& run, const Parts& parts) {
  if (parts.mounts) run.write_mounts(kBegin - 1000);
  for (int i = 0; i < parts.frames; ++i) {
    const StampNs t = kBegin + i * kPeriod;
    const cv::Mat depth(6, 8, CV_16UC1, cv::Scalar(1500)), labels(6, 8, CV_8UC1, cv::Scalar(7));
    run.write("/a/depth/image_raw", t, image_payload(t, "a/camera", "16UC1", depth));
    if (i < parts.infos) {
      run.write("/a/depth/camera_info", t + 10, camera_info_payload(t, "a/camera", kCamera));
    }
    if (parts.masks) {
      run.write("/a/segmentation", t + 20, image_payload(t, "a/camera", "mono8", labels));
    }
    run.write("/a/odom", t + 30, odometry_payload(t, "map", "a/base", pose_at("a", t)));
  }
  run.writer().close();
}

/// zstd without the size of the content.
Bytes as_stream(const std::uint8_t* data, std::size_t size) {
  Bytes out(ZSTD_compressBound(size));
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
  out.resize(ZSTD_compress2(context, out.data(), out.size(), data, size));
  ZSTD_freeCCtx(context);
  return out;
}

TEST(RecordedRobots, OneCameraInfoIsEnoughForTheWholeRun) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  write_a(run, {true, true, 1, 100});
  const auto reader = open_recorded(options_for({folder / "run.mcap"}));
  EXPECT_EQ(frames_of(*reader).size(), 100u);
  EXPECT_TRUE(reader->problems().empty()) << all_of(*reader);
}

TEST(RecordedRobots, MasksThatEndDoNotCostTheOtherFrames) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  run.write_mounts(kBegin - 1000);
  for (int i = 0; i < 200; ++i) run.write_frame("a", kBegin + i * kPeriod, i < 20);
  run.writer().close();
  const auto reader = open_recorded(options_for({folder / "run.mcap"}));
  EXPECT_EQ(frames_of(*reader).size(), 200u);
  EXPECT_TRUE(says(*reader, "rt/a/segmentation: no_mask: 180 times in all")) << all_of(*reader);
}

TEST(RecordedRobots, WithoutMountTheMissingTransformAndItsPlaceAreNamed) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  write_a(run, {false});
  DatasetOptions options = options_for({folder / "run.mcap"});
  const auto reader = open_recorded(options);
  EXPECT_TRUE(frames_of(*reader).empty());
  EXPECT_TRUE(says(*reader,
                   "no_transform: no transform leads from \"a/camera\" to \"map\": nobody "
                   "says where \"a/camera\" is"))
      << all_of(*reader);
  EXPECT_TRUE(says(*reader, "rt/tf_static: the recording has no message on it")) << all_of(*reader);
  EXPECT_TRUE(says(*reader, "20 without pose")) << all_of(*reader);

  // The node's mount works offline.
  RobotConfig robot;
  robot.name = "a";
  robot.mount.given = true;
  robot.mount.base_frame = "a/base";
  robot.mount.z_m = 0.5;
  options.input.robots = {robot};
  const auto mounted = open_recorded(options);
  const std::vector<Frame> frames = frames_of(*mounted);
  ASSERT_EQ(frames.size(), 20u) << all_of(*mounted);
  EXPECT_EQ(frames[3].T_W_C.translation(),
            pose_at("a", frames[3].stamp_ns).position + Eigen::Vector3d(0, 0, 0.5));
}

TEST(RecordedRobots, TransformsOfTheRobotsOwnWorkAsOnTheBus) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  run.add_channel("/a/tf", "tf2_msgs/msg/TFMessage");
  run.add_channel("/a/tf_static", "tf2_msgs/msg/TFMessage");
  run.write("/a/tf_static", kBegin - 9, tf_payload(0, "base", "a/camera", PoseQuaternion{}));
  const cv::Mat depth(6, 8, CV_16UC1, cv::Scalar(1500));
  for (int i = 0; i < 20; ++i) {
    const StampNs t = kBegin + i * kPeriod;
    run.write("/a/depth/image_raw", t, image_payload(t, "a/camera", "16UC1", depth));
    run.write("/a/depth/camera_info", t, camera_info_payload(t, "a/camera", kCamera));
    run.write("/a/tf", t, tf_payload(t, "map", "base", pose_at("a", t)));
  }
  run.writer().close();
  DatasetOptions options = options_for({folder / "run.mcap"});
  options.input.topics.tf = "rt/{robot}/tf";
  options.input.topics.tf_static = "rt/{robot}/tf_static";
  const auto reader = open_recorded(options);
  EXPECT_EQ(frames_of(*reader).size(), 20u) << all_of(*reader);
}

TEST(RecordedRobots, TopicsThatAreThereAreListedWhenNoneFits) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  run.writer().close();
  McapWriter other(folder / "other.mcap");
  for (const char* topic : {"/r/cam/depth/image_rect_raw", "/r/cam/color/image_raw"}) {
    other.add_channel(other.add_schema("sensor_msgs/msg/Image", "ros2msg", ""), topic, "cdr", {});
  }
  other.add_channel(other.add_schema("sensor_msgs/msg/CameraInfo", "ros2msg", ""),
                    "/r/cam/depth/camera_info", "cdr", {});
  other.close();
  try {
    open_recorded(options_for({folder / "other.mcap"}));
    FAIL();
  } catch (const InputError& error) {
    const std::string said = error.what();
    for (const char* part :
         {"no depth images on rt/{robot}/depth/image_raw", "rt/r/cam/color/image_raw",
          "--set 'node.topics.depth=rt/{robot}/cam/depth/image_rect_raw' --set "
          "'node.topics.camera_info=rt/{robot}/cam/depth/camera_info'"}) {
      EXPECT_NE(said.find(part), std::string::npos) << part << "\n" << said;
    }
  }
}

TEST(RecordedRobots, CompressedDepthIsReadByItsTopic) {
  const TemporaryFolder folder;
  const auto file = folder / "run.mcap";
  {
    RecordedRun run(file);
    run.add_channel("/a/depth/image_raw/compressedDepth", "sensor_msgs/msg/CompressedImage");
    run.write_mounts(kBegin - 1000);
    for (int i = 0; i < 5; ++i) {
      const StampNs t = kBegin + i * kPeriod;
      const cv::Mat depth(6, 8, CV_16UC1, cv::Scalar(1500 + i));
      run.write("/a/depth/image_raw/compressedDepth", t,
                compressed_depth_payload(t, "a/camera", depth));
      run.write("/a/depth/camera_info", t, camera_info_payload(t, "a/camera", kCamera));
      run.write("/a/odom", t, odometry_payload(t, "map", "a/base", pose_at("a", t)));
    }
    run.writer().close();
  }
  DatasetOptions options = options_for({file});
  options.input.topics.depth = "/{robot}/depth/image_raw/compressedDepth";
  const auto reader = open_recorded(options);
  const std::vector<Frame> frames = frames_of(*reader);
  ASSERT_EQ(frames.size(), 5u) << all_of(*reader);
  EXPECT_FLOAT_EQ(frames[4].depth_m.at<float>(2, 2), 1.504f);
}

TEST(RecordedRobots, AnotherTypeOnATopicIsNamed) {
  const TemporaryFolder folder;
  RecordedRun run(folder / "run.mcap");
  run.add_channel("/b2/odom", "geometry_msgs/msg/PoseStamped");
  run.add_channel("/b2/depth/image_raw", "sensor_msgs/msg/Image");
  run.write("/b2/odom", kBegin, Bytes{0, 1, 0, 0});
  write_a(run, {});
  const auto reader = open_recorded(options_for({folder / "run.mcap"}));
  EXPECT_EQ(frames_of(*reader).size(), 20u);
  EXPECT_TRUE(says(*reader,
                   "rt/b2/odom: wrong_type: has type geometry_msgs/msg/PoseStamped, "
                   "expected nav_msgs/msg/Odometry"))
      << all_of(*reader);
}

// rosbag2's compression of single messages, and of whole files.
TEST(RecordedRobots, CompressedMessagesAndFilesAreUnpacked) {
  const TemporaryFolder folder;
  const auto plain = folder / "plain.mcap", messages = folder / "messages.mcap",
             whole = folder / "whole.mcap.zstd";
  {
    RecordedRun run(plain);
    write_a(run, {});
  }
  {
    const auto reader = open_recording(plain);
    McapWriter writer(messages);
    std::vector<std::uint16_t> channels;
    for (const RecordedChannel& channel : reader->channels()) {
      channels.push_back(writer.add_channel(writer.add_schema(channel.type, "ros2msg", ""),
                                            channel.topic, "cdr", {}));
    }
    RecordedMessage message;
    while (reader->next(message)) {
      Bytes packed;
      compress(ChunkCompression::kZstd, 1, Bytes(message.data, message.data + message.size),
               packed);
      if (message.log_time_ns / 10 % 2 == 1) packed = as_stream(message.data, message.size);
      writer.write({channels[message.channel], 0, message.log_time_ns, 0}, packed.data(),
                   packed.size());
    }
    writer.close();
  }
  {
    Bytes packed;
    compress(ChunkCompression::kZstd, 1, file_bytes(plain), packed);
    std::ofstream(whole, std::ios::binary)
        .write(reinterpret_cast<const char*>(packed.data()),
               static_cast<std::streamsize>(packed.size()));
  }
  for (const auto& file : {messages, whole}) {
    const auto reader = open_recorded(options_for({file}));
    EXPECT_EQ(frames_of(*reader).size(), 20u) << file;
    EXPECT_TRUE(reader->problems().empty()) << all_of(*reader);
  }
  Bytes cut = file_bytes(whole);
  cut.resize(cut.size() / 2);
  std::ofstream(whole, std::ios::binary)
      .write(reinterpret_cast<const char*>(cut.data()), static_cast<std::streamsize>(cut.size()));
  try {
    open_recording(whole);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("whole.mcap.zstd: zstd: "), std::string::npos);
  }
}

TEST(RecordedRobots, ABagsFilesComeInTheOrderOfItsMetadata) {
  const TemporaryFolder folder;
  for (const char* name : {"a.mcap", "b.mcap"}) std::ofstream(folder / name) << "x";
  std::ofstream(folder / "metadata.yaml")
      << "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - b.mcap\n"
         "    - bag/a.mcap\n";
  for (const auto& input : {folder.path(), folder / "metadata.yaml"}) {
    const auto files = recording_files(input);
    ASSERT_EQ(files.size(), 2u);
    EXPECT_EQ(files[0].filename(), "b.mcap");
    EXPECT_EQ(files[1].filename(), "a.mcap");
  }
  std::filesystem::remove(folder / "b.mcap");
  try {
    recording_files(folder.path());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("names b.mcap, which is not in the folder"),
              std::string::npos);
  }
}

// What rosbag2 opens a folder by.
TEST(RecordedRobots, ASplitRecordingHasItsMetadata) {
  const TemporaryFolder folder;
  SplitOptions options;
  options.most_duration_ns = 500'000'000;
  const auto record = [&](const std::string& name) {
    SplitWriter writer(folder / name, options);
    const std::uint16_t schema = writer.add_schema("std_msgs/msg/String", "ros2msg", "string data");
    const std::uint16_t channel =
        writer.add_channel(schema, "/a", "cdr", {{"offered_qos_profiles", "- depth: \"1\"\n"}});
    for (int i = 0; i < 11; ++i) {
      writer.write({channel, 0, 1000u + static_cast<std::uint64_t>(i) * 100'000'000u, 0},
                   reinterpret_cast<const std::uint8_t*>("x"), 1);
    }
    writer.close();
    return std::make_pair(writer.files().size(), writer.listed());
  };
  EXPECT_EQ(record("run.mcap"), std::make_pair(std::size_t{3}, true));
  const auto files = recording_files(folder.path());
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[2].filename(), "run_0002.mcap");
  const Bytes bytes = file_bytes(folder / "metadata.yaml");
  const std::string text(bytes.begin(), bytes.end());
  for (const char* part :
       {"version: 5", "storage_identifier: mcap", "message_count: 11\n",
        "nanoseconds_since_epoch: 1000\n", "nanoseconds: 1000000000\n", "name: \"/a\"",
        "type: \"std_msgs/msg/String\"", "offered_qos_profiles: \"- depth: \\\"1\\\"\\n\""}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
  EXPECT_EQ(record("other.mcap"), std::make_pair(std::size_t{3}, false)) << "left alone";
  EXPECT_EQ(file_bytes(folder / "metadata.yaml"), bytes);
  EXPECT_EQ(record("run.mcap").second, true) << "replaced by its own";
}

}  // namespace
}  // namespace pocd::recording
