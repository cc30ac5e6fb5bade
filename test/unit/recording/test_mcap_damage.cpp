// Whatever happens to a file: no crash, a problem that names the offset, and the rest is read.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "pocd/common/check.hpp"
#include "recordings.hpp"

namespace pocd::recording {
namespace {

struct Sample {
  Bytes bytes;
  std::vector<Kept> kept;
  std::vector<std::size_t> record_ends;  // in the file
  std::vector<std::size_t> chunk_offsets;
};

Sample make_sample(ChunkCompression compression) {
  const TemporaryFolder folder;
  McapWriterOptions options;
  options.compression = compression;
  options.chunk_bytes = 1500;
  McapWriter writer(folder / "a.mcap", options);
  Sample sample;
  sample.kept = write_messages(writer, 120, 300);
  writer.close();
  sample.bytes = file_bytes(folder / "a.mcap");
  std::size_t at = kMcapMagic.size();
  while (at + kRecordHeaderBytes <= sample.bytes.size() - kMcapMagic.size()) {
    ByteReader in(sample.bytes.data() + at, kRecordHeaderBytes);
    const auto opcode = in.number<std::uint8_t>();
    if (opcode == static_cast<std::uint8_t>(Opcode::kChunk)) sample.chunk_offsets.push_back(at);
    at += kRecordHeaderBytes + static_cast<std::size_t>(in.number<std::uint64_t>());
    sample.record_ends.push_back(at);
  }
  return sample;
}

/// True when `part` can be had from `whole` by leaving messages out.
bool is_part_of(const std::vector<Kept>& part, const std::vector<Kept>& whole) {
  std::size_t at = 0;
  for (const Kept& kept : part) {
    while (at < whole.size() && !(whole[at] == kept)) ++at;
    if (at++ == whole.size()) return false;
  }
  return true;
}

std::size_t messages_before(const Sample& sample, std::size_t offset) {
  // Chunks that end at or before the offset, by reading the file cut there.
  std::size_t count = 0;
  McapReader whole = read_memory(sample.bytes);
  std::vector<std::size_t> ends;
  for (const std::size_t chunk : sample.chunk_offsets) {
    const auto end = *std::upper_bound(sample.record_ends.begin(), sample.record_ends.end(), chunk);
    if (end > offset) break;
    ByteReader in(sample.bytes.data() + chunk + kRecordHeaderBytes,
                  end - chunk - kRecordHeaderBytes);
    const ChunkHeader header = parse_chunk_header(in);
    for (const Kept& kept : sample.kept) {
      count += kept.log_time_ns >= header.start_ns && kept.log_time_ns <= header.end_ns;
    }
  }
  return count;
}

class McapDamage : public testing::TestWithParam<ChunkCompression> {};

TEST_P(McapDamage, CutAnywhereReadsUpToTheLastWholeChunk) {
  const Sample sample = make_sample(GetParam());
  std::set<std::size_t> cuts;
  for (const std::size_t end : sample.record_ends) {
    for (const int shift : {-1, 0, 1}) cuts.insert(end + shift);
  }
  for (std::size_t i = 0; i < sample.bytes.size(); i += 37) cuts.insert(i);
  for (const std::size_t cut : cuts) {
    if (cut >= sample.bytes.size()) continue;
    Bytes bytes(sample.bytes.begin(), sample.bytes.begin() + static_cast<std::ptrdiff_t>(cut));
    if (cut < kMcapMagic.size() + kRecordHeaderBytes) {
      EXPECT_THROW(read_memory(bytes), InputError);
      continue;
    }
    McapReader reader = read_memory(bytes);
    const std::vector<Kept> read = read_all(reader);
    ASSERT_EQ(read.size(), messages_before(sample, cut)) << "cut at " << cut;
    ASSERT_TRUE(is_part_of(read, sample.kept));
    ASSERT_GT(reader.problem_count(), 0u) << "cut at " << cut;
    ASSERT_NE(reader.problems()[0].find("offset "), std::string::npos);
  }
}

TEST_P(McapDamage, FlippedBitsCostAtMostTheirChunk) {
  const Sample sample = make_sample(GetParam());
  Random random(3);
  const std::size_t most_in_chunk = 30;
  for (int trial = 0; trial < 3000; ++trial) {
    Bytes bytes = sample.bytes;
    const std::size_t at = random.below(bytes.size());
    bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << random.below(8)));
    try {
      McapReader reader = read_memory(bytes);
      const std::vector<Kept> read = read_all(reader);
      ASSERT_TRUE(is_part_of(read, sample.kept)) << "flip at " << at;
      ASSERT_GE(read.size() + most_in_chunk, sample.kept.size()) << "flip at " << at;
      if (read.size() != sample.kept.size()) {
        ASSERT_GT(reader.problem_count(), 0u);
      }
    } catch (const InputError& error) {
      FAIL() << "flip at " << at << ": " << error.what();
    }
  }
}

TEST_P(McapDamage, ManyFlippedBytesNeverCrash) {
  const Sample sample = make_sample(GetParam());
  Random random(5);
  ReaderLimits limits;
  limits.chunk_bytes = 1u << 20;
  for (int trial = 0; trial < 1000; ++trial) {
    Bytes bytes = sample.bytes;
    for (std::uint64_t n = 1 + random.below(60); n > 0; --n) {
      bytes[random.below(bytes.size())] = static_cast<std::uint8_t>(random.below(256));
    }
    try {
      McapReader reader = read_memory(bytes, limits);
      read_all(reader);
      EXPECT_LE(reader.problems().size(), RecordingReader::kMostProblems);
    } catch (const InputError&) {
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Compressions, McapDamage, testing::ValuesIn(kCompressions),
                         [](const auto& info) { return word_of(info.param); });

void put(Bytes& bytes, std::size_t at, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

std::string first_problem(const McapReader& reader) {
  return reader.problems().empty() ? "" : reader.problems()[0];
}

TEST(McapDefects, WrongMagic) {
  Sample sample = make_sample(ChunkCompression::kZstd);
  sample.bytes[3] = 'X';
  McapReader reader = read_memory(sample.bytes);
  EXPECT_TRUE(read_all(reader) == sample.kept);
  EXPECT_EQ(first_problem(reader), "memory: offset 0: magic is wrong, but a header record follows");
  EXPECT_THROW(read_memory(Bytes(1000, 'x')), InputError);
  EXPECT_THROW(read_memory({}), InputError);
}

TEST(McapDefects, MissingFooter) {
  Sample sample = make_sample(ChunkCompression::kZstd);
  sample.bytes.resize(sample.bytes.size() - kFooterBytes - kMcapMagic.size());
  McapReader reader = read_memory(sample.bytes);
  EXPECT_TRUE(read_all(reader) == sample.kept);
  EXPECT_TRUE(reader.info().recovered);
  EXPECT_EQ(reader.info().messages, sample.kept.size());
  EXPECT_NE(first_problem(reader).find("no footer"), std::string::npos);
}

TEST(McapDefects, AbsurdLengths) {
  for (const std::uint64_t length :
       {std::uint64_t{0}, std::uint64_t{1} << 20, std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    Sample sample = make_sample(ChunkCompression::kZstd);
    put(sample.bytes, sample.chunk_offsets[2] + 1, length);  // of the record
    sample.bytes.resize(sample.bytes.size() - 1);            // and no footer
    McapReader reader = read_memory(sample.bytes);
    const std::vector<Kept> read = read_all(reader);
    EXPECT_TRUE(is_part_of(read, sample.kept));
    EXPECT_GT(read.size(), sample.kept.size() - 30);
    EXPECT_LT(read.size(), sample.kept.size());
    const std::string where = "offset " + std::to_string(sample.chunk_offsets[2]);
    EXPECT_TRUE(std::any_of(reader.problems().begin(), reader.problems().end(), [&](const auto& p) {
      return p.find(where) != std::string::npos;
    })) << where;
  }
  Sample sample = make_sample(ChunkCompression::kZstd);
  put(sample.bytes, sample.chunk_offsets[2] + 9 + 16, ~std::uint64_t{0});  // uncompressed size
  McapReader reader = read_memory(sample.bytes);
  EXPECT_GT(read_all(reader).size(), sample.kept.size() - 30);
  EXPECT_NE(first_problem(reader).find("are not read"), std::string::npos);
}

TEST(McapDefects, UnknownCompression) {
  Sample sample = make_sample(ChunkCompression::kZstd);
  sample.bytes[sample.chunk_offsets[1] + 9 + 8 + 8 + 8 + 4 + 4] = 'q';
  McapReader reader = read_memory(sample.bytes);
  EXPECT_GT(read_all(reader).size(), sample.kept.size() - 30);
  EXPECT_EQ(first_problem(reader), "memory: offset " + std::to_string(sample.chunk_offsets[1]) +
                                       ": compression 'qstd' is unknown; the chunk is left out");
}

TEST(McapDefects, ChunksOfZeroLength) {
  Bytes bytes(kMcapMagic.begin(), kMcapMagic.end());
  append_record(bytes, Opcode::kHeader, Bytes(8));
  for (const char* compression : {"", "lz4", "zstd"}) {
    ChunkHeader empty;
    empty.compression = compression;
    append_chunk(bytes, empty, nullptr);
  }
  append_record(bytes, Opcode::kChunk, {});  // not even the fields of a chunk
  McapReader reader = read_memory(bytes);
  EXPECT_TRUE(read_all(reader).empty());
  EXPECT_GE(reader.problem_count(), 2u);
}

TEST(McapDefects, DefinitionsCannotFillTheMemory) {
  // 40 chunks that each unpack to a schema of 2 MB would take 80 MB.
  Bytes bytes(kMcapMagic.begin(), kMcapMagic.end());
  append_record(bytes, Opcode::kHeader, Bytes(8));
  const TemporaryFolder folder;
  McapWriterOptions options;
  options.chunk_bytes = 1;
  McapWriter writer(folder / "a.mcap", options);
  for (int i = 0; i < 40; ++i) {
    const auto schema = writer.add_schema("a", "ros2msg", std::string(2u << 20, 'a'));
    const auto channel = writer.add_channel(schema, "/t" + std::to_string(i), "cdr", {});
    writer.write({channel, 0, 1, 1}, bytes.data(), 1);
  }
  writer.close();
  Bytes file = file_bytes(folder / "a.mcap");
  McapReader reader = read_memory(file);
  std::size_t schema_bytes = 0;
  for (const RecordedChannel& channel : reader.channels()) schema_bytes += channel.schema.size();
  EXPECT_LE(schema_bytes, 64u << 20);
  EXPECT_GT(reader.problem_count(), 0u);
}

TEST(McapReader, ReadsMessagesOutsideOfChunks) {
  Bytes bytes(kMcapMagic.begin(), kMcapMagic.end());
  append_record(bytes, Opcode::kHeader, Bytes(8));
  append_channel(bytes, {4, 0, "/a", "cdr", {}});
  const Bytes data{1, 2, 3};
  for (std::uint32_t i = 0; i < 10; ++i) append_message(bytes, {4, i, 100 - i, 0}, data.data(), 3);
  append_record(bytes, Opcode::kDataEnd, Bytes(4));
  append_record(bytes, Opcode::kFooter, Bytes(20));
  bytes.insert(bytes.end(), kMcapMagic.begin(), kMcapMagic.end());
  McapReader reader = read_memory(bytes);
  const std::vector<Kept> read = read_all(reader);
  ASSERT_EQ(read.size(), 10u);
  EXPECT_EQ(read.front().log_time_ns, 91u);
  EXPECT_EQ(read.back().log_time_ns, 100u);
  EXPECT_EQ(reader.problem_count(), 0u);
}

}  // namespace
}  // namespace pocd::recording
