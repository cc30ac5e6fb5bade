// Recordings of other kinds, in other forms, and under other names: read, or refused with a word on
// what to do.
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include "compression.hpp"
#include "pocd/common/check.hpp"
#include "pocd/recording/recording_files.hpp"
#include "pocd/recording/ros_messages.hpp"
#include "recorded_run.hpp"

namespace pocd::recording {
namespace {

constexpr StampNs kBegin = 5'000'000'000;

std::string all_of(const DatasetReader& reader) {
  std::string text;
  for (const std::string& problem : reader.problems()) text += problem + "\n";
  return text;
}
testing::AssertionResult says(const DatasetReader& reader, const std::string& part) {
  if (all_of(reader).find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "not said: " << part << "\nsaid:\n" << all_of(reader);
}

void write_file(const std::filesystem::path& file, const Bytes& bytes) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}
void write_file(const std::filesystem::path& file, const std::string& text) {
  write_file(file, Bytes(text.begin(), text.end()));
}

template <class Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

/// Robot a; `begin` is the stamp of its first image.
void write_a(const std::filesystem::path& file, StampNs begin = kBegin, bool mounts = true) {
  RecordedRun run(file);
  if (mounts) run.write_mounts(begin - 1000);
  for (int i = 0; i < 10; ++i) run.write_frame("a", begin + i * kPeriod);
  run.writer().close();
}

/// The same messages under other names of topics and types, and in another encoding.
template <class Rename>
void rewrite(const std::filesystem::path& from, const std::filesystem::path& to,
             const Rename& rename, const std::string& encoding = "cdr",
             ChunkCompression compression = ChunkCompression::kNone) {
  const auto reader = open_recording(from);
  McapWriter writer(to);
  std::vector<std::uint16_t> channels;
  for (const RecordedChannel& channel : reader->channels()) {
    const auto [topic, type] = rename(channel.topic, channel.type);
    channels.push_back(
        writer.add_channel(writer.add_schema(type, "ros2msg", ""), topic, encoding, {}));
  }
  RecordedMessage message;
  while (reader->next(message)) {
    Bytes packed;
    compress(compression, 1, Bytes(message.data, message.data + message.size), packed);
    writer.write({channels[message.channel], 0, message.log_time_ns, 0}, packed.data(),
                 packed.size());
  }
  writer.close();
}
using Names = std::pair<std::string, std::string>;
Names same(const std::string& topic, const std::string& type) { return {topic, type}; }

TEST(OtherRecordings, FilesOfOtherKindsSayWhatTheyAre) {
  const TemporaryFolder folder;
  const std::string rest(4000, '\0');
  const std::vector<std::pair<std::string, std::string>> kinds{
      {"#ROSBAG V2.0\n", "is a bag of ROS 1: convert it (rosbags-convert)"},
      {"\x04\x22\x4D\x18", "is compressed with lz4: unpack it (lz4 -d)"},
      {"\x1F\x8B", "is compressed with gzip"},
      {"PK\x03\x04", "is a zip archive"}};
  for (const auto& [magic, what] : kinds) {
    write_file(folder / "in.mcap", magic + rest);
    EXPECT_NE(refusal([&] { open_recording(folder / "in.mcap"); }).find("in.mcap: " + what),
              std::string::npos)
        << what;
  }
}

TEST(OtherRecordings, CompressionOfOthersIsNamedByMetadataAndMessages) {
  const TemporaryFolder folder;
  write_a(folder / "plain.mcap");
  rewrite(folder / "plain.mcap", folder / "x_0.mcap", same, "cdr", ChunkCompression::kLz4);
  const std::string list = "rosbag2_bagfile_information:\n  relative_file_paths: [x_0.mcap]\n";
  write_file(folder / "metadata.yaml", list +
                                           "  compression_mode: MESSAGE\n"
                                           "  compression_format: lz4\n");
  EXPECT_NE(refusal([&] {
              recording_files(folder.path());
            }).find("metadata.yaml: compression_format is \"lz4\", only zstd is read"),
            std::string::npos);
  // Without such a word each topic has one line, and the others are counted.
  const auto reader = open_recorded(options_for({folder / "x_0.mcap"}));
  EXPECT_TRUE(frames_of(*reader).empty());
  EXPECT_TRUE(says(*reader, "/a/odom at 5040000000 ns: a compressed message is left out: lz4"));
  EXPECT_TRUE(says(*reader, "x_0.mcap: 37 more of its problems"));
}

// The list names the file as it was before, or after, somebody packed it.
TEST(OtherRecordings, MetadataFindsItsFilesPackedAndUnpacked) {
  const TemporaryFolder folder;
  write_a(folder / "plain.mcap");
  const Bytes plain = file_bytes(folder / "plain.mcap");
  Bytes packed;
  compress(ChunkCompression::kZstd, 1, plain, packed);
  const auto metadata = folder / "metadata.yaml";
  write_file(folder / "x_0.mcap.zstd", packed);
  write_file(metadata, "rosbag2_bagfile_information:\n  relative_file_paths: [bag/x_0.mcap]\n");
  ASSERT_EQ(recording_files(metadata).size(), 1u);
  EXPECT_EQ(recording_files(metadata)[0].filename(), "x_0.mcap.zstd");
  std::filesystem::remove(folder / "x_0.mcap.zstd");
  write_file(folder / "x_0.mcap", plain);
  write_file(metadata, "rosbag2_bagfile_information:\n  relative_file_paths: [x_0.mcap.zstd]\n");
  ASSERT_EQ(recording_files(metadata).size(), 1u);
  EXPECT_EQ(recording_files(metadata)[0].filename(), "x_0.mcap");
  std::filesystem::remove(folder / "x_0.mcap");
  EXPECT_NE(refusal([&] { recording_files(metadata); }).find("names x_0.mcap.zstd, which is not"),
            std::string::npos);
  write_file(metadata, "a: [1,\nb");
  EXPECT_NE(refusal([&] { recording_files(metadata); }).find("line 2"), std::string::npos);
}

// rosbag2 leaves its files in the mode of a write-ahead log.
TEST(OtherRecordings, ADatabaseIsReadAsItIs) {
  const TemporaryFolder folder;
  const auto file = folder / "50% of it?.db3";
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  const auto run = [&](const char* query) {
    EXPECT_EQ(sqlite3_exec(database, query, nullptr, nullptr, nullptr), SQLITE_OK) << query;
  };
  run("PRAGMA journal_mode=WAL");
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
      "data BLOB); INSERT INTO topics VALUES(1, '/a', 'std_msgs/msg/String', 'cdr'); INSERT INTO "
      "messages VALUES(1, 1, 5, x'00010000')");
  // As a recorder that was killed leaves it, and somebody who copies only the .db3.
  std::filesystem::copy(file, folder / "alone.db3");
  EXPECT_NE(refusal([&] {
              open_recording(folder / "alone.db3");
            }).find("the file of the same name with -wal belongs to it"),
            std::string::npos);
  EXPECT_EQ(open_recording(file)->info().messages, 1u) << "with its log";
  sqlite3_close(database);
  EXPECT_EQ(open_recording(file)->info().messages, 1u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2)
      << "no file was made beside the recordings";
  Bytes bytes = file_bytes(file);
  bytes.resize(bytes.size() / 2);
  write_file(file, bytes);
  EXPECT_NE(refusal([&] { open_recording(file); }).find("is damaged or cut off"),
            std::string::npos);
}

TEST(OtherRecordings, NamesOfTypesAsOnTheBusAndOfOtherWritersAreRead) {
  const TemporaryFolder folder;
  write_a(folder / "plain.mcap");
  rewrite(folder / "plain.mcap", folder / "dds.mcap", [](std::string topic, std::string type) {
    const std::size_t at = type.find("/msg/");
    if (at == std::string::npos || topic[0] != '/') return Names{topic, type};
    return Names{"rt" + topic, type.substr(0, at) + "::msg::dds_::" + type.substr(at + 5) + "_"};
  });
  rewrite(folder / "plain.mcap", folder / "short.mcap", [](std::string topic, std::string type) {
    const std::size_t at = type.find("/msg/");
    if (at != std::string::npos) type.erase(at, 4);
    return Names{topic, type};
  });
  for (const char* name : {"dds.mcap", "short.mcap"}) {
    const auto reader = open_recorded(options_for({folder / name}));
    EXPECT_EQ(frames_of(*reader).size(), 10u) << name << "\n" << all_of(*reader);
  }
  rewrite(folder / "plain.mcap", folder / "ros1.mcap", same, "ros1");
  const auto reader = open_recorded(options_for({folder / "ros1.mcap"}));
  EXPECT_TRUE(frames_of(*reader).empty());
  EXPECT_TRUE(says(*reader,
                   "rt/a/odom: wrong_type: has messages in \"ros1\", expected \"cdr\": a "
                   "recording of ROS 1 has to be converted"));
}

TEST(OtherRecordings, WhatIsThereUnderOtherNamesIsSaidWithTheOption) {
  const TemporaryFolder folder;
  write_a(folder / "plain.mcap");
  const auto renamed = [&](const std::string& from, const std::string& to) {
    rewrite(folder / "plain.mcap", folder / "in.mcap", [&](std::string topic, std::string type) {
      return Names{topic == from ? to : topic, type};
    });
    auto reader = open_recorded(options_for({folder / "in.mcap"}));
    frames_of(*reader);
    return reader;
  };
  EXPECT_TRUE(says(*renamed("/a/depth/camera_info", "/a/depth/info"),
                   "rt/a/depth/camera_info: the recording has no message on it; there is "
                   "rt/a/depth/info; try --set 'node.topics.camera_info=rt/{robot}/depth/info'"));
  EXPECT_TRUE(says(*renamed("/a/segmentation", "/semantic/image"),
                   "rt/a/segmentation: the recording has no message on it; there is "
                   "rt/semantic/image; try --robot a --set 'node.topics.segmentation="
                   "rt/semantic/image'"));
  EXPECT_TRUE(says(*renamed("/a/odom", "/a/odometry/filtered"),
                   "rt/a/odom and rt/tf: the recording has no message on it; there is "
                   "rt/a/odometry/filtered (nav_msgs/msg/Odometry); try --set "
                   "'node.topics.odometry=rt/{robot}/odometry/filtered'"));
  // A robot without masks is none that has them elsewhere.
  EXPECT_EQ(all_of(*renamed("/a/segmentation", "/a/color/image_raw")), "");
}

TEST(OtherRecordings, OfACameraInfoDistortionAndProjectionAreRead) {
  const auto payload = [](double k1) {
    CdrWriter out;
    put_header(out, 5, "camera");
    for (const std::uint32_t side : {6u, 8u}) out.number(side);
    out.string("plumb_bob");
    out.number(std::uint32_t{5});
    for (const double d : {k1, 0.0, 0.0, 0.0, 0.0}) out.number(d);
    for (const double k : {5.0, 0.0, 3.5, 0.0, 5.0, 2.5, 0.0, 0.0, 1.0}) out.number(k);
    for (int i = 0; i < 9; ++i) out.number(0.0);
    for (const double p : {4.0, 0.0, 3.0, 0.0, 0.0, 4.5, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0})
      out.number(p);
    for (int i = 0; i < 6; ++i) out.number(std::uint32_t{0});
    out.number(std::uint8_t{0});
    return out.bytes();
  };
  const auto camera_of = [&](double k1) {
    const Bytes bytes = payload(k1);
    return *camera_model(decode_camera_info(bytes.data(), bytes.size()).fields).value;
  };
  EXPECT_EQ(camera_of(-0.3), (CameraModel{8, 6, 4, 4.5, 3, 2}));
  EXPECT_EQ(camera_of(0.0), (CameraModel{8, 6, 5, 5, 3.5, 2.5}));
}

TEST(OtherRecordings, AFileThatIsMovedBehindAnotherIsSaid) {
  const TemporaryFolder folder;
  write_a(folder / "late.mcap", kBegin + 20 * kPeriod);
  write_a(folder / "early.mcap", kBegin);
  const auto reader = open_recorded(options_for({folder / "late.mcap", folder / "early.mcap"}));
  EXPECT_EQ(frames_of(*reader).size(), 20u);
  EXPECT_TRUE(says(*reader,
                   "early.mcap: begins at 5000000000 ns, before the file before it ended: taken as "
                   "another run, 3900000000 ns later"));
  const auto in_order = open_recorded(options_for({folder / "early.mcap", folder / "late.mcap"}));
  EXPECT_EQ(frames_of(*in_order).size(), 20u);
  EXPECT_EQ(all_of(*in_order), "");
}

TEST(OtherRecordings, WithoutTopicsTheDamageIsSaid) {
  const TemporaryFolder folder;
  write_a(folder / "plain.mcap");
  Bytes bytes = file_bytes(folder / "plain.mcap");
  bytes.resize(60);
  write_file(folder / "cut.mcap", bytes);
  const std::string said = refusal([&] { open_recorded(options_for({folder / "cut.mcap"})); });
  EXPECT_NE(said.find("there is no topic at all"), std::string::npos) << said;
  EXPECT_NE(said.find("was the recording cut off?"), std::string::npos) << said;
}

}  // namespace
}  // namespace pocd::recording
