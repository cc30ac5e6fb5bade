// MCAP summaries that are valid and leave something out.
#include <gtest/gtest.h>

#include "recordings.hpp"

namespace pocd::recording {
namespace {

/// A file of one chunk with three messages, whose summary a test composes.
class Composed {
 public:
  Composed() {
    bytes_.assign(kMcapMagic.begin(), kMcapMagic.end());
    Bytes header;
    ByteWriter(header).string("ros2");
    ByteWriter(header).string("test");
    append_record(bytes_, Opcode::kHeader, header);
  }
  void add_chunk(int messages) {
    Bytes records;
    append_schema(records, schema());
    append_channel(records, channel(1));
    for (int i = 0; i < messages; ++i) {
      append_message(records, {1, 0, 10u + static_cast<std::uint64_t>(i), 0},
                     reinterpret_cast<const std::uint8_t*>("abcd"), 4);
    }
    ChunkIndexRecord index;
    index.chunk_offset = bytes_.size();
    index.start_ns = 10;
    index.end_ns = 10u + static_cast<std::uint64_t>(messages);
    append_chunk(bytes_, {10, index.end_ns, records.size(), 0, "", records.size()}, records.data());
    index.chunk_length = bytes_.size() - index.chunk_offset;
    index.uncompressed_size = index.compressed_size = records.size();
    if (messages > 0) index.message_index_offsets[1] = 0;
    indexes.push_back(index);
    statistics.messages += static_cast<std::uint64_t>(messages);
    statistics.messages_of_channel[1] += static_cast<std::uint64_t>(messages);
    ++statistics.chunks;
  }
  static SchemaRecord schema() { return {1, "std_msgs/msg/String", "ros2msg", "string data"}; }
  static ChannelRecord channel(std::uint16_t id) {
    return {id, 1, "/t" + std::to_string(id), "cdr", {}};
  }
  /// What the reader makes of it; a summary without any record is none.
  McapReader read(bool with_schema, const std::vector<std::uint16_t>& channels, bool with_indexes,
                  bool with_statistics) {
    Bytes bytes = bytes_;
    append_record(bytes, Opcode::kDataEnd, Bytes(4, 0));
    const std::uint64_t start = bytes.size();
    if (with_schema) append_schema(bytes, schema());
    for (const std::uint16_t id : channels) append_channel(bytes, channel(id));
    if (with_statistics) append_statistics(bytes, statistics);
    if (with_indexes) {
      for (const ChunkIndexRecord& index : indexes) append_chunk_index(bytes, index);
    }
    Bytes footer;
    ByteWriter writer(footer);
    writer.number(bytes.size() == start ? std::uint64_t{0} : start);
    writer.number(std::uint64_t{0});
    writer.number(std::uint32_t{0});
    append_record(bytes, Opcode::kFooter, footer);
    bytes.insert(bytes.end(), kMcapMagic.begin(), kMcapMagic.end());
    return read_memory(bytes);
  }

  std::vector<ChunkIndexRecord> indexes;
  StatisticsRecord statistics;

 private:
  Bytes bytes_;
};

TEST(McapSummaries, WhateverAValidOneLeavesOutIsNoDamage) {
  for (const bool schema : {true, false}) {
    for (const bool indexes : {true, false}) {
      for (const bool statistics : {true, false}) {
        for (const std::vector<std::uint16_t>& channels :
             {std::vector<std::uint16_t>{1}, {}, {1, 2}}) {
          Composed file;
          file.statistics.schemas = 1;
          file.statistics.channels = 3;  // as libmcap counts: also those without messages
          file.add_chunk(3);
          McapReader reader = file.read(schema, channels, indexes, statistics);
          EXPECT_EQ(reader.problem_count(), 0u)
              << (reader.problems().empty() ? "" : reader.problems()[0]);
          EXPECT_EQ(reader.info().messages, 3u);
          EXPECT_EQ(read_all(reader).size(), 3u);
          // By the index where there is all that it takes.
          EXPECT_EQ(reader.info().recovered,
                    !(schema && indexes && statistics && !channels.empty()));
        }
      }
    }
  }
}

TEST(McapSummaries, AnEmptyChunkMayBeLeftOutOfTheIndex) {
  Composed file;
  file.statistics.schemas = 1;
  file.statistics.channels = 1;
  file.add_chunk(3);
  file.add_chunk(0);
  file.indexes.pop_back();
  McapReader reader = file.read(true, {1}, true, true);
  EXPECT_EQ(reader.problem_count(), 0u);
  EXPECT_EQ(read_all(reader).size(), 3u);
}

TEST(McapSummaries, AnIndexThatPointsBesideItsChunkIsStillDamage) {
  Composed file;
  file.statistics.schemas = 1;
  file.statistics.channels = 1;
  file.add_chunk(3);
  file.indexes[0].chunk_offset += 1'000'000;
  McapReader reader = file.read(true, {1}, true, true);
  EXPECT_GT(reader.problem_count(), 0u);
  EXPECT_EQ(read_all(reader).size(), 3u);
}

}  // namespace
}  // namespace pocd::recording
