#include <gtest/gtest.h>

#include <algorithm>

#include "pocd/common/check.hpp"
#include "recordings.hpp"

namespace pocd::recording {
namespace {

class McapRoundTrip : public testing::TestWithParam<ChunkCompression> {};

TEST_P(McapRoundTrip, GivesBackEveryByte) {
  const TemporaryFolder folder;
  McapWriterOptions options;
  options.compression = GetParam();
  options.chunk_bytes = 3000;
  std::vector<Kept> kept;
  {
    McapWriter writer(folder / "a.mcap", options);
    kept = write_messages(writer, 500, 400);
    writer.close();
    EXPECT_EQ(writer.bytes_written(), std::filesystem::file_size(folder / "a.mcap"));
  }
  const auto reader = open_recording(folder / "a.mcap");
  EXPECT_FALSE(reader->info().recovered);
  EXPECT_EQ(reader->info().messages, 500u);
  EXPECT_GT(reader->info().chunks, 20u);
  EXPECT_EQ(reader->info().start_ns, 1000u);
  EXPECT_EQ(reader->info().end_ns, 1000u + 4990u);
  EXPECT_EQ(reader->info().profile, "ros2");
  ASSERT_EQ(reader->channels().size(), 3u);
  EXPECT_EQ(reader->channels()[0].type, "std_msgs/msg/String");
  EXPECT_EQ(reader->channels()[0].metadata.at("qos"), "x: 1");
  EXPECT_TRUE(read_all(*reader) == kept);
  EXPECT_EQ(reader->problem_count(), 0u);
}
INSTANTIATE_TEST_SUITE_P(Compressions, McapRoundTrip, testing::ValuesIn(kCompressions),
                         [](const auto& info) { return word_of(info.param); });

TEST(McapReader, OrdersByLogTimeAcrossOverlappingChunks) {
  const TemporaryFolder folder;
  McapWriterOptions options;
  options.chunk_bytes = 600;
  McapWriter writer(folder / "a.mcap", options);
  const std::uint16_t channel = writer.add_channel(0, "/a", "cdr", {});
  Random random(7);
  std::vector<std::uint64_t> times;
  const Bytes data(50);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    times.push_back(i * 10 + random.below(500));  // out of order by up to 50 messages, 5 chunks
    writer.write({channel, i, times.back(), 0}, data.data(), data.size());
  }
  writer.close();
  std::sort(times.begin(), times.end());
  const auto reader = open_recording(folder / "a.mcap");
  std::vector<std::uint64_t> read;
  for (const Kept& kept : read_all(*reader)) read.push_back(kept.log_time_ns);
  EXPECT_EQ(read, times);
  EXPECT_EQ(reader->problem_count(), 0u);

  ReaderLimits limits;
  limits.loaded_bytes = 1;
  McapReader limited(open_file_source(folder / "a.mcap"), "a", limits);
  EXPECT_EQ(read_all(limited).size(), times.size());
  ASSERT_EQ(limited.problem_count(), 1u);
  EXPECT_NE(limited.problems()[0].find("overlap"), std::string::npos);
}

TEST(McapReader, SeeksAndSelects) {
  const TemporaryFolder folder;
  McapWriterOptions options;
  options.chunk_bytes = 2000;
  McapWriter writer(folder / "a.mcap", options);
  std::vector<Kept> kept = write_messages(writer, 300, 100);
  writer.close();
  const auto reader = open_recording(folder / "a.mcap");
  reader->seek(2505);
  auto from =
      std::find_if(kept.begin(), kept.end(), [](const Kept& k) { return k.log_time_ns >= 2505; });
  EXPECT_TRUE(read_all(*reader) == std::vector<Kept>(from, kept.end()));
  reader->select([](const RecordedChannel& channel) { return channel.topic == "/b"; });
  reader->seek(0);
  kept.erase(
      std::remove_if(kept.begin(), kept.end(), [](const Kept& k) { return k.topic != "/b"; }),
      kept.end());
  EXPECT_TRUE(read_all(*reader) == kept);
}

TEST(McapWriter, WorksWithNothingInIt) {
  const TemporaryFolder folder;
  McapWriter(folder / "a.mcap").close();
  const auto reader = open_recording(folder / "a.mcap");
  EXPECT_TRUE(read_all(*reader).empty());
  EXPECT_EQ(reader->problem_count(), 0u);
  EXPECT_FALSE(reader->info().recovered);
}

TEST(McapWriter, RefusesWhatReadersWouldNotTake) {
  const TemporaryFolder folder;
  McapWriterOptions options;
  options.compression = static_cast<ChunkCompression>(9);
  EXPECT_THROW(McapWriter(folder / "a.mcap", options), InputError);
  McapWriter writer(folder / "b.mcap");
  const std::uint16_t channel = writer.add_channel(0, "/a", "cdr", {});
  const std::uint8_t byte = 0;
  EXPECT_THROW(writer.write({channel, 0, 0, 0}, &byte, McapWriter::kLargestMessage + 1),
               InputError);
  EXPECT_THROW(McapWriter(folder / "no/such/folder.mcap"), InputError);
}

TEST(McapWriter, HoldsManyMessagesAndChannels) {
  const TemporaryFolder folder;
  McapWriter writer(folder / "a.mcap");
  const std::uint16_t schema = writer.add_schema("a/msg/A", "ros2msg", "uint8 a\n");
  for (int i = 0; i < 2000; ++i) {
    writer.add_channel(schema, "/topic" + std::to_string(i), "cdr", {});
  }
  const Bytes data{0, 1, 0, 0, 7};
  for (std::uint32_t i = 0; i < 300'000; ++i) {
    writer.write({static_cast<std::uint16_t>(i % 2000), i, i, i}, data.data(), data.size());
  }
  writer.close();
  const auto reader = open_recording(folder / "a.mcap");
  RecordedMessage m;
  std::uint32_t count = 0;
  while (reader->next(m)) {
    ASSERT_EQ(m.sequence, count);
    ASSERT_EQ(reader->channels()[m.channel].topic, "/topic" + std::to_string(count % 2000));
    ++count;
  }
  EXPECT_EQ(count, 300'000u);
  EXPECT_EQ(reader->channels()[1999].messages, 150u);
}

}  // namespace
}  // namespace pocd::recording
