// How an MCAP file is understood before its messages are read: by its summary, or by a walk
// through.
#include <algorithm>
#include <cstdlib>
#include <set>

#include "compression.hpp"
#include "pocd/recording/mcap_reader.hpp"

namespace pocd::recording {
namespace {

// Names, schemas and metadata; anything larger is damage.
constexpr std::uint64_t kLargestDefinition = 16u << 20;
// A summary grows with the chunks: 100 bytes and 10 per channel each.
constexpr std::uint64_t kLargestSummary = 256u << 20;
constexpr std::size_t kSearchBytes = 1u << 20;
// Opcode, length, start, end, size, crc, compression ("zstd" is the longest name), size of the
// records.
constexpr std::size_t kChunkSignatureBytes = kRecordHeaderBytes + 8 + 8 + 8 + 4 + 4 + 4 + 8;

}  // namespace

bool McapReader::read_summary() {
  const std::uint64_t end_bytes = kFooterBytes + kMcapMagic.size();
  const std::uint64_t size = source_->size();
  if (size < kMcapMagic.size() + end_bytes) {
    note(size, "the file ends before its footer; reading it through");
    return false;
  }
  const std::uint64_t footer_offset = size - end_bytes;
  const Bytes end = source_->read(footer_offset, end_bytes);
  ByteReader in(end.data(), end.size());
  const bool is_footer = in.number<std::uint8_t>() == static_cast<std::uint8_t>(Opcode::kFooter) &&
                         in.number<std::uint64_t>() == 20;
  if (!is_footer || !std::equal(kMcapMagic.begin(), kMcapMagic.end(), end.begin() + kFooterBytes)) {
    note(footer_offset, "no footer at the end (was the recording cut off?); reading it through");
    return false;
  }
  const FooterRecord footer = parse_footer(in);
  if (footer.summary_start == 0) return false;  // allowed: a file without summary
  try {
    if (read_summary_records(footer, footer_offset)) return true;
  } catch (const DamagedData& damage) {
    note(damage.offset(),
         std::string("summary is damaged: ") + damage.what() + "; reading the file through");
  }
  schemas_.clear();
  channel_records_.clear();
  channel_index_.clear();
  channels_.clear();
  blocks_.clear();
  info_.chunks_by_compression.clear();
  definition_bytes_ = 0;
  return false;
}

bool McapReader::read_summary_records(const FooterRecord& footer, std::uint64_t footer_offset) {
  if (footer.summary_start < kMcapMagic.size() || footer.summary_start > footer_offset ||
      footer_offset - footer.summary_start > kLargestSummary) {
    throw DamagedData(footer_offset,
                      "footer says it starts at " + std::to_string(footer.summary_start));
  }
  const auto length = static_cast<std::size_t>(footer_offset - footer.summary_start);
  const Bytes bytes = source_->read(footer.summary_start, length + kFooterBytes);
  if (footer.summary_crc != 0 &&
      footer.summary_crc != crc32_of(bytes.data(), bytes.size() - sizeof footer.summary_crc)) {
    throw DamagedData(footer.summary_start, "its CRC does not fit");
  }
  ByteReader in(bytes.data(), length);
  std::optional<StatisticsRecord> statistics;
  std::set<std::uint16_t> indexed;  // channels with messages
  const std::uint64_t problems_before = problem_count();
  while (in.remaining() > 0) {
    const std::uint64_t at = footer.summary_start + in.position();
    try {
      const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
      const ByteReader content = in.part(in.number<std::uint64_t>());
      if (opcode == Opcode::kSchema) define(parse_schema(content), at);
      if (opcode == Opcode::kChannel) {
        const ChannelRecord channel = parse_channel(content);
        if (channel.schema_id != 0 && schemas_.count(channel.schema_id) == 0) return false;
        define(channel, at);
      }
      if (opcode == Opcode::kStatistics) statistics = parse_statistics(content);
      if (opcode == Opcode::kChunkIndex) {
        const ChunkIndexRecord index = parse_chunk_index(content);
        if (index.chunk_offset >= footer.summary_start ||
            index.chunk_length <= kRecordHeaderBytes ||
            index.chunk_length > footer.summary_start - index.chunk_offset) {
          throw DamagedData(at, "a chunk is said to be at " + std::to_string(index.chunk_offset));
        }
        blocks_.push_back(
            {index.start_ns, index.end_ns, index.chunk_offset, index.chunk_length, true});
        ++info_.chunks_by_compression[index.compression];
        for (const auto& [channel, offset] : index.message_index_offsets) indexed.insert(channel);
      }
    } catch (const DamagedData& damage) {
      throw DamagedData(at, damage.what());
    }
  }
  if (problem_count() != problems_before) {
    throw DamagedData(footer.summary_start, "its records contradict each other");
  }
  // Messages may stand outside of chunks, and a summary need not repeat anything: only one that
  // accounts for all of them will do. Channels and chunks without messages may be left out.
  if (!statistics || statistics->chunks != blocks_.size() ||
      (blocks_.empty() && statistics->messages > 0) || !lists_channels_of(*statistics, indexed)) {
    return false;
  }
  info_.messages = statistics->messages;
  info_.chunks = statistics->chunks;
  info_.start_ns = statistics->start_ns;
  info_.end_ns = statistics->end_ns;
  for (const auto& [channel, count] : statistics->messages_of_channel) {
    const auto known = channel_index_.find(channel);
    if (known != channel_index_.end()) channels_[known->second].messages = count;
  }
  return true;
}

bool McapReader::lists_channels_of(const StatisticsRecord& statistics,
                                   const std::set<std::uint16_t>& indexed) const {
  const auto known = [&](std::uint16_t channel) { return channel_index_.count(channel) > 0; };
  std::uint64_t counted = 0;
  for (const auto& [channel, count] : statistics.messages_of_channel) {
    if (count > 0 && !known(channel)) return false;
    counted += count;
  }
  // Who does not count by channel may have channels that are defined in the chunks only.
  if (counted != statistics.messages) return false;
  return std::all_of(indexed.begin(), indexed.end(), known);
}

bool McapReader::looks_like_chunk(std::uint64_t offset, const std::uint8_t* bytes) const {
  if (bytes[0] != static_cast<std::uint8_t>(Opcode::kChunk)) return false;
  ByteReader in(bytes + 1, kChunkSignatureBytes - 1);
  const auto length = in.number<std::uint64_t>();
  if (length > source_->size() - offset - kRecordHeaderBytes || length > limits_.chunk_bytes) {
    return false;
  }
  try {
    const ChunkHeader header = parse_chunk_header(in);
    const std::uint64_t fixed = 8 + 8 + 8 + 4 + 4 + header.compression.size() + 8;
    return length >= fixed && header.records_size == length - fixed &&
           header.start_ns <= header.end_ns && header.uncompressed_size <= limits_.chunk_bytes &&
           compression_named(header.compression).has_value();
  } catch (const DamagedData&) {
    return false;
  }
}

std::uint64_t McapReader::find_chunk(std::uint64_t from) const {
  const std::uint64_t size = source_->size();
  while (from + kChunkSignatureBytes <= size) {
    const auto length =
        static_cast<std::size_t>(std::min<std::uint64_t>(kSearchBytes, size - from));
    const Bytes bytes = source_->read(from, length);
    for (std::size_t i = 0; i + kChunkSignatureBytes <= length; ++i) {
      if (looks_like_chunk(from + i, bytes.data() + i)) return from + i;
    }
    from += length - kChunkSignatureBytes + 1;
  }
  return size;
}

void McapReader::scan_record(Opcode opcode, std::uint64_t offset, std::uint64_t length) {
  const std::uint64_t content_offset = offset + kRecordHeaderBytes;
  if (opcode == Opcode::kChunk) {
    Block block{0, 0, offset, kRecordHeaderBytes + length, true};
    const std::size_t start =
        static_cast<std::size_t>(std::min<std::uint64_t>(length, kChunkSignatureBytes));
    const Bytes head = source_->read(content_offset, start);
    ByteReader in(head.data(), head.size());
    const ChunkHeader header = parse_chunk_header(in);
    block.start_ns = header.start_ns;
    block.end_ns = header.end_ns;
    const Bytes bytes = block_bytes(block);
    const std::vector<Entry> entries = entries_of(bytes, block, true);
    ++info_.chunks;
    ++info_.chunks_by_compression[header.compression];
    if (entries.empty()) return;
    // What the messages say, since the header was not checked by any CRC.
    block.start_ns = entries.front().log_time_ns;
    block.end_ns = entries.back().log_time_ns;
    blocks_.push_back(block);
  } else if (opcode == Opcode::kMessage || opcode == Opcode::kSchema ||
             opcode == Opcode::kChannel) {
    const std::uint64_t limit =
        opcode == Opcode::kMessage ? limits_.chunk_bytes : kLargestDefinition;
    if (length > limit) {
      throw DamagedData(offset, "record of " + std::to_string(length) + " bytes is too large");
    }
    const Block record{0, 0, offset, kRecordHeaderBytes + length, false};
    const std::vector<Entry> entries = entries_of(block_bytes(record), record, true);
    if (entries.empty()) return;
    const std::uint64_t time_ns = entries.front().log_time_ns;
    // Messages that follow each other are read together later.
    constexpr std::uint64_t kRunBytes = 1u << 20;
    if (!blocks_.empty() && !blocks_.back().is_chunk &&
        blocks_.back().offset + blocks_.back().length == offset &&
        blocks_.back().length + record.length <= kRunBytes) {
      Block& run = blocks_.back();
      run.length += record.length;
      run.start_ns = std::min(run.start_ns, time_ns);
      run.end_ns = std::max(run.end_ns, time_ns);
    } else {
      blocks_.push_back({time_ns, time_ns, offset, record.length, false});
    }
  }
}

void McapReader::scan() {
  info_.recovered = true;
  const std::uint64_t size = source_->size();
  std::uint64_t offset = kMcapMagic.size();
  bool footer = false;
  while (offset < size && !footer) {
    std::string problem;
    std::uint64_t next = offset;
    try {
      if (size - offset < kRecordHeaderBytes)
        throw DamagedData(offset, "the file ends in a record");
      const Bytes head = source_->read(offset, kRecordHeaderBytes);
      ByteReader in(head.data(), head.size());
      const auto opcode = in.number<std::uint8_t>();
      const auto length = in.number<std::uint64_t>();
      // Opcodes from 0x80 are free for private use.
      if (opcode == 0 || (opcode > static_cast<std::uint8_t>(Opcode::kDataEnd) && opcode < 0x80)) {
        throw DamagedData(offset, "no record begins here (opcode " + std::to_string(opcode) + ")");
      }
      if (length > size - offset - kRecordHeaderBytes) {
        throw DamagedData(offset, "record announces " + std::to_string(length) + " bytes, " +
                                      std::to_string(size - offset - kRecordHeaderBytes) +
                                      " are left in the file");
      }
      next = offset + kRecordHeaderBytes + length;
      footer = opcode == static_cast<std::uint8_t>(Opcode::kFooter);
      scan_record(static_cast<Opcode>(opcode), offset, length);
      offset = next;
      continue;
    } catch (const DamagedData& damage) {
      problem = damage.what();
    }
    // The end of a chunk that looks like one can be trusted although its content cannot.
    bool skip = false;
    if (next > offset && size - offset >= kChunkSignatureBytes) {
      const Bytes head = source_->read(offset, kChunkSignatureBytes);
      skip = looks_like_chunk(offset, head.data());
    }
    const std::uint64_t resumed = skip ? next : find_chunk(offset + 1);
    note(offset, problem + (resumed >= size ? "; nothing readable follows"
                                            : "; going on at " + std::to_string(resumed)));
    offset = resumed;
    footer = false;
  }
}

}  // namespace pocd::recording
