// Files of other programs, when they are there.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "pocd/common/check.hpp"
#include "pocd/recording/ros_messages.hpp"
#include "pocd/recording/recording_files.hpp"
#include "recordings.hpp"

namespace pocd::recording {
namespace {

std::filesystem::path others() { return std::filesystem::path(POCD_TEST_DATA) / "recordings"; }

#define NEEDS(file)                         \
  if (!std::filesystem::exists(file)) {     \
    GTEST_SKIP() << file << " is not here"; \
  }

TEST(OthersFiles, Rosbag2OdometryDecodes) {
  const auto file = others() / "autoware_odometry.db3";
  NEEDS(file);
  const auto reader = open_recording(file);
  RecordedMessage m;
  int odometry = 0;
  std::uint64_t last_ns = 0;
  while (reader->next(m)) {
    EXPECT_GE(m.log_time_ns, last_ns);
    last_ns = m.log_time_ns;
    if (reader->channels()[m.channel].type != "nav_msgs/msg/Odometry") continue;
    const RosTransform T = decode_odometry(m.data, m.size);
    EXPECT_EQ(T.header.frame_id, "map");
    EXPECT_EQ(T.child_frame_id, "base_link");
    EXPECT_NEAR(T.T.rotation.norm(), 1.0, 1e-6);
    ++odometry;
  }
  EXPECT_EQ(odometry, 2819);
  EXPECT_EQ(reader->problem_count(), 0u);
}

TEST(OthersFiles, McapOfOtherWritersOpens) {
  for (const char* name : {"configuration.mcap", "configuration_type.mcap", "ros2_talker.mcap"}) {
    const auto file = others() / name;
    NEEDS(file);
    const auto reader = open_recording(file);
    const std::uint64_t announced = reader->info().messages;
    EXPECT_GT(announced, 0u) << name;
    EXPECT_EQ(read_all(*reader).size(), announced) << name;
    EXPECT_EQ(reader->problem_count(), 0u) << name << ": " << reader->problems()[0];
    EXPECT_FALSE(reader->info().recovered) << name;
    // Reading through from the start finds the same.
    Bytes cut = file_bytes(file);
    cut.resize(cut.size() - 4);
    McapReader recovered = read_memory(cut);
    EXPECT_EQ(recovered.info().messages, announced) << name;
    EXPECT_EQ(recovered.channels().size(), reader->channels().size()) << name;
  }
}

TEST(OthersFiles, DamagedDatabasesAreNamed) {
  const TemporaryFolder folder;
  const auto file = folder / "a.db3";
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  const char* setup =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data "
      "BLOB);"
      "INSERT INTO topics VALUES(7, '/a', 'std_msgs/msg/String', 'cdr');"
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 2000)"
      "INSERT INTO messages SELECT i, 7, 5000 - i, zeroblob(100) FROM n;";
  ASSERT_EQ(sqlite3_exec(database, setup, nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
  {
    const auto reader = open_recording(file);
    const std::vector<Kept> read = read_all(*reader);
    ASSERT_EQ(read.size(), 2000u);
    EXPECT_EQ(read[0].log_time_ns, 3000u);
    EXPECT_EQ(read[0].topic, "/a");
    reader->seek(4999);
    EXPECT_EQ(read_all(*reader).size(), 1u);
  }
  const Bytes good = file_bytes(file);
  const auto write = [&](const Bytes& bytes) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  };
  Random random(11);
  for (int trial = 0; trial < 100; ++trial) {
    Bytes bytes = good;
    if (trial % 2 == 0) bytes.resize(16 + random.below(bytes.size() - 16));
    for (int i = 0; i < 200; ++i) {
      bytes[16 + random.below(bytes.size() - 16)] = static_cast<std::uint8_t>(random.below(256));
    }
    write(bytes);
    try {
      const auto reader = open_recording(file);
      EXPECT_LE(read_all(*reader).size(), 200'000u);
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("a.db3"), std::string::npos);
    }
  }
}

TEST(OthersFiles, FoldersListTheirFilesByNumber) {
  const TemporaryFolder folder;
  for (const char* name : {"run_10.mcap", "run_2.mcap", "metadata.yaml", "run_1.mcap"}) {
    std::ofstream(folder / name) << "x";
  }
  const auto files = recording_files(folder.path());
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[0].filename(), "run_1.mcap");
  EXPECT_EQ(files[1].filename(), "run_2.mcap");
  EXPECT_EQ(files[2].filename(), "run_10.mcap");
  EXPECT_THROW(recording_files(folder / "none"), InputError);
}

}  // namespace
}  // namespace pocd::recording
