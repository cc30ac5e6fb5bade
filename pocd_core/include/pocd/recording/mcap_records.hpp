// The records of an MCAP file, as published at https://mcap.dev/spec (version 0). A record is its
// opcode (8 bits), the length of its content (64 bits) and the content; numbers are little endian.
#pragma once

#include <array>
#include <map>
#include <utility>

#include "pocd/recording/bytes.hpp"

namespace pocd::recording {

inline constexpr std::array<std::uint8_t, 8> kMcapMagic{0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
inline constexpr std::size_t kRecordHeaderBytes = 9;
inline constexpr std::size_t kFooterBytes = kRecordHeaderBytes + 20;
inline constexpr std::size_t kMessageHeaderBytes = 22;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

struct SchemaRecord {
  std::uint16_t id = 0;  ///< > 0
  std::string name, encoding, data;
};

struct ChannelRecord {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: no schema
  std::string topic, message_encoding;
  std::map<std::string, std::string> metadata;
};

struct MessageHeader {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
};

/// What stands before the records of a chunk.
struct ChunkHeader {
  std::uint64_t start_ns = 0, end_ns = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not known
  std::string compression;             ///< "", "lz4" (frame format), "zstd"
  std::uint64_t records_size = 0;
};

struct ChunkIndexRecord {
  std::uint64_t start_ns = 0, end_ns = 0;
  std::uint64_t chunk_offset = 0, chunk_length = 0;
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
};

struct StatisticsRecord {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;
  std::uint64_t start_ns = 0, end_ns = 0;
  std::map<std::uint16_t, std::uint64_t> messages_of_channel;
};

struct FooterRecord {
  std::uint64_t summary_start = 0, summary_offset_start = 0;
  std::uint32_t summary_crc = 0;
};

/// Parsers take the content of a record, and throw DamagedData.
SchemaRecord parse_schema(ByteReader in);
ChannelRecord parse_channel(ByteReader in);
MessageHeader parse_message_header(ByteReader& in);  ///< leaves `in` at the payload
ChunkHeader parse_chunk_header(ByteReader& in);      ///< leaves `in` at the records
ChunkIndexRecord parse_chunk_index(ByteReader in);
StatisticsRecord parse_statistics(ByteReader in);
FooterRecord parse_footer(ByteReader in);

/// Append a whole record.
void append_record(Bytes& out, Opcode opcode, const Bytes& content);
void append_schema(Bytes& out, const SchemaRecord& schema);
void append_channel(Bytes& out, const ChannelRecord& channel);
void append_message(Bytes& out, const MessageHeader& header, const std::uint8_t* data,
                    std::size_t size);
void append_chunk(Bytes& out, const ChunkHeader& header, const std::uint8_t* records);
/// `entries`: log time and offset within the uncompressed chunk.
void append_message_index(Bytes& out, std::uint16_t channel,
                          const std::vector<std::pair<std::uint64_t, std::uint64_t>>& entries);
void append_chunk_index(Bytes& out, const ChunkIndexRecord& index);
void append_statistics(Bytes& out, const StatisticsRecord& statistics);
void append_summary_offset(Bytes& out, Opcode group, std::uint64_t start, std::uint64_t length);

}  // namespace pocd::recording
