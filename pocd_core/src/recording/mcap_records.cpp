#include "pocd/recording/mcap_records.hpp"

namespace pocd::recording {
namespace {

std::map<std::uint16_t, std::uint64_t> number_map(ByteReader& in) {
  ByteReader body = in.part(in.number<std::uint32_t>());
  std::map<std::uint16_t, std::uint64_t> map;
  while (body.remaining() > 0) {
    const auto key = body.number<std::uint16_t>();
    map[key] = body.number<std::uint64_t>();
  }
  return map;
}

void append_number_map(ByteWriter& out, const std::map<std::uint16_t, std::uint64_t>& map) {
  out.number(static_cast<std::uint32_t>(map.size() * 10));
  for (const auto& [key, value] : map) {
    out.number(key);
    out.number(value);
  }
}

}  // namespace

SchemaRecord parse_schema(ByteReader in) {
  SchemaRecord schema;
  schema.id = in.number<std::uint16_t>();
  schema.name = in.string();
  schema.encoding = in.string();
  schema.data = in.string();
  return schema;
}

ChannelRecord parse_channel(ByteReader in) {
  ChannelRecord channel;
  channel.id = in.number<std::uint16_t>();
  channel.schema_id = in.number<std::uint16_t>();
  channel.topic = in.string();
  channel.message_encoding = in.string();
  channel.metadata = in.string_map();
  return channel;
}

MessageHeader parse_message_header(ByteReader& in) {
  MessageHeader header;
  header.channel = in.number<std::uint16_t>();
  header.sequence = in.number<std::uint32_t>();
  header.log_time_ns = in.number<std::uint64_t>();
  header.publish_time_ns = in.number<std::uint64_t>();
  return header;
}

ChunkHeader parse_chunk_header(ByteReader& in) {
  ChunkHeader header;
  header.start_ns = in.number<std::uint64_t>();
  header.end_ns = in.number<std::uint64_t>();
  header.uncompressed_size = in.number<std::uint64_t>();
  header.uncompressed_crc = in.number<std::uint32_t>();
  header.compression = in.string();
  header.records_size = in.number<std::uint64_t>();
  return header;
}

ChunkIndexRecord parse_chunk_index(ByteReader in) {
  ChunkIndexRecord index;
  index.start_ns = in.number<std::uint64_t>();
  index.end_ns = in.number<std::uint64_t>();
  index.chunk_offset = in.number<std::uint64_t>();
  index.chunk_length = in.number<std::uint64_t>();
  index.message_index_offsets = number_map(in);
  index.message_index_length = in.number<std::uint64_t>();
  index.compression = in.string();
  index.compressed_size = in.number<std::uint64_t>();
  index.uncompressed_size = in.number<std::uint64_t>();
  return index;
}

StatisticsRecord parse_statistics(ByteReader in) {
  StatisticsRecord s;
  s.messages = in.number<std::uint64_t>();
  s.schemas = in.number<std::uint16_t>();
  s.channels = in.number<std::uint32_t>();
  s.attachments = in.number<std::uint32_t>();
  s.metadata = in.number<std::uint32_t>();
  s.chunks = in.number<std::uint32_t>();
  s.start_ns = in.number<std::uint64_t>();
  s.end_ns = in.number<std::uint64_t>();
  s.messages_of_channel = number_map(in);
  return s;
}

FooterRecord parse_footer(ByteReader in) {
  FooterRecord footer;
  footer.summary_start = in.number<std::uint64_t>();
  footer.summary_offset_start = in.number<std::uint64_t>();
  footer.summary_crc = in.number<std::uint32_t>();
  return footer;
}

void append_record(Bytes& out, Opcode opcode, const Bytes& content) {
  ByteWriter writer(out);
  writer.number(static_cast<std::uint8_t>(opcode));
  writer.number(static_cast<std::uint64_t>(content.size()));
  writer.raw(content.data(), content.size());
}

void append_schema(Bytes& out, const SchemaRecord& schema) {
  Bytes content;
  ByteWriter writer(content);
  writer.number(schema.id);
  writer.string(schema.name);
  writer.string(schema.encoding);
  writer.string(schema.data);
  append_record(out, Opcode::kSchema, content);
}

void append_channel(Bytes& out, const ChannelRecord& channel) {
  Bytes content;
  ByteWriter writer(content);
  writer.number(channel.id);
  writer.number(channel.schema_id);
  writer.string(channel.topic);
  writer.string(channel.message_encoding);
  writer.string_map(channel.metadata);
  append_record(out, Opcode::kChannel, content);
}

void append_message(Bytes& out, const MessageHeader& header, const std::uint8_t* data,
                    std::size_t size) {
  ByteWriter writer(out);
  writer.number(static_cast<std::uint8_t>(Opcode::kMessage));
  writer.number(static_cast<std::uint64_t>(kMessageHeaderBytes + size));
  writer.number(header.channel);
  writer.number(header.sequence);
  writer.number(header.log_time_ns);
  writer.number(header.publish_time_ns);
  writer.raw(data, size);
}

void append_chunk(Bytes& out, const ChunkHeader& header, const std::uint8_t* records) {
  const std::uint64_t fixed_bytes = 8 + 8 + 8 + 4 + 4 + header.compression.size() + 8;
  ByteWriter writer(out);
  writer.number(static_cast<std::uint8_t>(Opcode::kChunk));
  writer.number(fixed_bytes + header.records_size);
  writer.number(header.start_ns);
  writer.number(header.end_ns);
  writer.number(header.uncompressed_size);
  writer.number(header.uncompressed_crc);
  writer.string(header.compression);
  writer.number(header.records_size);
  writer.raw(records, static_cast<std::size_t>(header.records_size));
}

void append_message_index(Bytes& out, std::uint16_t channel,
                          const std::vector<std::pair<std::uint64_t, std::uint64_t>>& entries) {
  ByteWriter writer(out);
  writer.number(static_cast<std::uint8_t>(Opcode::kMessageIndex));
  writer.number(static_cast<std::uint64_t>(2 + 4 + 16 * entries.size()));
  writer.number(channel);
  writer.number(static_cast<std::uint32_t>(16 * entries.size()));
  for (const auto& [time, offset] : entries) {
    writer.number(time);
    writer.number(offset);
  }
}

void append_chunk_index(Bytes& out, const ChunkIndexRecord& index) {
  Bytes content;
  ByteWriter writer(content);
  writer.number(index.start_ns);
  writer.number(index.end_ns);
  writer.number(index.chunk_offset);
  writer.number(index.chunk_length);
  append_number_map(writer, index.message_index_offsets);
  writer.number(index.message_index_length);
  writer.string(index.compression);
  writer.number(index.compressed_size);
  writer.number(index.uncompressed_size);
  append_record(out, Opcode::kChunkIndex, content);
}

void append_statistics(Bytes& out, const StatisticsRecord& s) {
  Bytes content;
  ByteWriter writer(content);
  writer.number(s.messages);
  writer.number(s.schemas);
  writer.number(s.channels);
  writer.number(s.attachments);
  writer.number(s.metadata);
  writer.number(s.chunks);
  writer.number(s.start_ns);
  writer.number(s.end_ns);
  append_number_map(writer, s.messages_of_channel);
  append_record(out, Opcode::kStatistics, content);
}

void append_summary_offset(Bytes& out, Opcode group, std::uint64_t start, std::uint64_t length) {
  Bytes content;
  ByteWriter writer(content);
  writer.number(static_cast<std::uint8_t>(group));
  writer.number(start);
  writer.number(length);
  append_record(out, Opcode::kSummaryOffset, content);
}

}  // namespace pocd::recording
