#include "pocd/recording/mcap_writer.hpp"

#include <algorithm>
#include <limits>

#include "compression.hpp"
#include "output_file.hpp"
#include "pocd/common/check.hpp"

namespace pocd::recording {

McapWriter::McapWriter(const std::filesystem::path& path, McapWriterOptions options)
    : options_(std::move(options)) {
  Bytes probe;
  compress(options_.compression, options_.level, {}, probe);  // refuses what is none
  file_ = std::make_unique<OutputFile>(path);
  Bytes out(kMcapMagic.begin(), kMcapMagic.end());
  Bytes content;
  ByteWriter header(content);
  header.string("ros2");
  header.string("pocd");
  append_record(out, Opcode::kHeader, content);
  file_->append(out);
}

McapWriter::~McapWriter() {
  try {
    close();
  } catch (const std::exception&) {
  }
}

std::uint16_t McapWriter::add_schema(const std::string& name, const std::string& encoding,
                                     const std::string& data) {
  POCD_CHECK(schemas_.size() < std::numeric_limits<std::uint16_t>::max());
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back({id, name, encoding, data});
  Bytes record;
  append_schema(record, schemas_.back());
  definition_bytes_ += record.size();
  ++statistics_.schemas;
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, const std::string& topic,
                                      const std::string& message_encoding,
                                      const std::map<std::string, std::string>& metadata) {
  POCD_CHECK(schema <= schemas_.size());
  POCD_CHECK(channels_.size() < std::numeric_limits<std::uint16_t>::max());
  const auto id = static_cast<std::uint16_t>(channels_.size());
  channels_.push_back({id, schema, topic, message_encoding, metadata});
  defined_.push_back(false);
  Bytes record;
  append_channel(record, channels_.back());
  definition_bytes_ += record.size();
  ++statistics_.channels;
  return id;
}

void McapWriter::define(std::uint16_t channel) {
  POCD_CHECK(channel < channels_.size());
  if (defined_[channel]) return;
  const std::uint16_t schema = channels_[channel].schema_id;
  bool schema_there = schema == 0;
  for (std::size_t i = 0; i < channels_.size() && !schema_there; ++i) {
    schema_there = defined_[i] && channels_[i].schema_id == schema;
  }
  if (!schema_there) append_schema(chunk_, schemas_[schema - 1]);
  append_channel(chunk_, channels_[channel]);
  defined_[channel] = true;
}

void McapWriter::write(const MessageHeader& header, const std::uint8_t* data, std::size_t size) {
  POCD_CHECK(open_);
  if (size > kLargestMessage) {
    throw InputError(channels_.at(header.channel).topic + ": message of " + std::to_string(size) +
                     " bytes is larger than a recording takes (" + std::to_string(kLargestMessage) +
                     ")");
  }
  if (!chunk_.empty() && chunk_.size() + size > options_.chunk_bytes) flush();
  define(header.channel);
  if (index_.empty()) {
    start_ns_ = end_ns_ = header.log_time_ns;
  }
  start_ns_ = std::min(start_ns_, header.log_time_ns);
  end_ns_ = std::max(end_ns_, header.log_time_ns);
  index_[header.channel].emplace_back(header.log_time_ns, chunk_.size());
  append_message(chunk_, header, data, size);
}

void McapWriter::flush() {
  POCD_CHECK(open_);
  if (index_.empty()) return;
  ChunkHeader header;
  header.start_ns = start_ns_;
  header.end_ns = end_ns_;
  header.uncompressed_size = chunk_.size();
  header.uncompressed_crc = crc32_of(chunk_.data(), chunk_.size());
  header.compression = mcap_name(options_.compression);
  Bytes records;
  compress(options_.compression, options_.level, chunk_, records);
  header.records_size = records.size();

  Bytes out;
  out.reserve(records.size() + 4096);
  append_chunk(out, header, records.data());
  ChunkIndexRecord chunk_index;
  chunk_index.start_ns = start_ns_;
  chunk_index.end_ns = end_ns_;
  chunk_index.chunk_offset = file_->size();
  chunk_index.chunk_length = out.size();
  chunk_index.compression = header.compression;
  chunk_index.compressed_size = records.size();
  chunk_index.uncompressed_size = chunk_.size();
  std::uint64_t messages = 0;
  for (auto& [channel, entries] : index_) {
    std::stable_sort(entries.begin(), entries.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    chunk_index.message_index_offsets[channel] = file_->size() + out.size();
    append_message_index(out, channel, entries);
    messages += entries.size();
  }
  chunk_index.message_index_length = out.size() - chunk_index.chunk_length;

  const std::size_t indexes_before = chunk_indexes_.size();
  append_chunk_index(chunk_indexes_, chunk_index);
  try {
    file_->reserve(out.size() + summary_bound());
    file_->append(out);
  } catch (const InputError& error) {
    chunk_indexes_.resize(indexes_before);
    chunk_.clear();
    index_.clear();
    finish();
    throw InputError(std::string(error.what()) + " (the last " + std::to_string(messages) +
                     " messages are lost, the file is closed and readable)");
  }
  if (statistics_.messages == 0) statistics_.start_ns = start_ns_;
  statistics_.start_ns = std::min(statistics_.start_ns, start_ns_);
  statistics_.end_ns = std::max(statistics_.end_ns, end_ns_);
  statistics_.messages += messages;
  for (const auto& [channel, entries] : index_) {
    statistics_.messages_of_channel[channel] += entries.size();
  }
  ++statistics_.chunks;
  chunk_.clear();
  index_.clear();
  defined_.assign(channels_.size(), false);
}

std::uint64_t McapWriter::summary_bound() const {
  // Definitions and chunk indexes as they are; statistics, offsets, footer and magic fit in the
  // rest.
  return definition_bytes_ + chunk_indexes_.size() + 10 * channels_.size() + 1024;
}

void McapWriter::finish() {
  open_ = false;
  Bytes out;
  ByteWriter data_end(out);
  data_end.number(static_cast<std::uint8_t>(Opcode::kDataEnd));
  data_end.number(std::uint64_t{4});
  data_end.number(file_->crc());
  const std::uint64_t base = file_->size();
  const std::size_t data_end_bytes = out.size();

  Bytes offsets;
  const auto group = [&](Opcode opcode, const auto& append) {
    const std::size_t begin = out.size();
    append();
    if (out.size() > begin)
      append_summary_offset(offsets, opcode, base + begin, out.size() - begin);
  };
  group(Opcode::kSchema, [&] {
    for (const SchemaRecord& schema : schemas_) append_schema(out, schema);
  });
  group(Opcode::kChannel, [&] {
    for (const ChannelRecord& channel : channels_) append_channel(out, channel);
  });
  group(Opcode::kStatistics, [&] { append_statistics(out, statistics_); });
  group(Opcode::kChunkIndex,
        [&] { out.insert(out.end(), chunk_indexes_.begin(), chunk_indexes_.end()); });
  const std::uint64_t offsets_start = base + out.size();
  out.insert(out.end(), offsets.begin(), offsets.end());

  ByteWriter footer(out);
  footer.number(static_cast<std::uint8_t>(Opcode::kFooter));
  footer.number(std::uint64_t{20});
  footer.number(base + data_end_bytes);
  footer.number(offsets_start);
  footer.number(crc32_of(out.data() + data_end_bytes, out.size() - data_end_bytes));
  footer.raw(kMcapMagic.data(), kMcapMagic.size());
  file_->append(out);
  file_->close();
}

void McapWriter::close() {
  if (!open_) return;
  flush();
  finish();
}

std::uint64_t McapWriter::bytes_written() const { return file_->size(); }

}  // namespace pocd::recording
