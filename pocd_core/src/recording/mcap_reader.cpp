#include "pocd/recording/mcap_reader.hpp"

#include <algorithm>

#include "compression.hpp"
#include "pocd/common/check.hpp"

namespace pocd::recording {

McapReader::McapReader(std::unique_ptr<ByteSource> source, std::string name,
                       const ReaderLimits& limits)
    : source_(std::move(source)), name_(std::move(name)), limits_(limits) {
  info_.format = "mcap";
  info_.bytes = source_->size();
  check_start();
  if (!read_summary()) scan();
  std::sort(blocks_.begin(), blocks_.end(), [](const Block& a, const Block& b) {
    return a.start_ns != b.start_ns ? a.start_ns < b.start_ns : a.offset < b.offset;
  });
}

void McapReader::note(std::uint64_t offset, const std::string& problem) {
  add_problem(name_ + ": offset " + std::to_string(offset) + ": " + problem);
}

void McapReader::check_start() {
  const std::uint64_t fixed = kMcapMagic.size() + kRecordHeaderBytes;
  if (source_->size() < fixed) {
    throw InputError(name_ + ": has " + std::to_string(source_->size()) +
                     " bytes, too few for MCAP");
  }
  const Bytes start = source_->read(0, fixed);
  const bool magic = std::equal(kMcapMagic.begin(), kMcapMagic.end(), start.begin());
  try {
    ByteReader in(start.data() + kMcapMagic.size(), kRecordHeaderBytes);
    const auto opcode = in.number<std::uint8_t>();
    const auto length = in.number<std::uint64_t>();
    if (opcode != static_cast<std::uint8_t>(Opcode::kHeader) || length > source_->size() - fixed ||
        length > (1u << 20)) {
      throw DamagedData(kMcapMagic.size(), "no header record");
    }
    const Bytes content = source_->read(fixed, static_cast<std::size_t>(length));
    ByteReader header(content.data(), content.size());
    info_.profile = header.string();
    info_.library = header.string();
  } catch (const DamagedData& damage) {
    if (!magic) throw InputError(name_ + ": offset 0: is not MCAP (wrong magic, no header record)");
    note(kMcapMagic.size(), std::string("header record is damaged: ") + damage.what());
  }
  if (!magic) note(0, "magic is wrong, but a header record follows");
}

// Small chunks can hold large definitions: without a bound a file of a few megabytes fills the
// memory.
void McapReader::count_definition(std::size_t bytes) {
  constexpr std::uint64_t kMostDefinitionBytes = 64u << 20;
  if (definition_bytes_ + bytes > kMostDefinitionBytes) {
    throw DamagedData(0, "schemas and channels take more than " +
                             std::to_string(kMostDefinitionBytes) + " bytes");
  }
  definition_bytes_ += bytes;
}

void McapReader::define(const SchemaRecord& schema, std::uint64_t offset) {
  if (schemas_.count(schema.id) == 0) {
    count_definition(schema.name.size() + schema.encoding.size() + schema.data.size());
  }
  const auto [known, fresh] = schemas_.emplace(schema.id, schema);
  if (!fresh && (known->second.name != schema.name || known->second.data != schema.data)) {
    note(offset, "schema " + std::to_string(schema.id) +
                     " is defined twice, differently; the first " + "definition is kept");
  }
}

void McapReader::define(const ChannelRecord& channel, std::uint64_t offset) {
  const auto known = channel_records_.find(channel.id);
  if (known != channel_records_.end()) {
    if (known->second.topic != channel.topic || known->second.schema_id != channel.schema_id ||
        known->second.message_encoding != channel.message_encoding) {
      note(offset, "channel " + std::to_string(channel.id) +
                       " is defined twice, differently; the first definition is kept");
    }
    return;
  }
  std::size_t bytes = channel.topic.size() + channel.message_encoding.size();
  for (const auto& [key, value] : channel.metadata) bytes += key.size() + value.size();
  RecordedChannel recorded;
  recorded.topic = channel.topic;
  recorded.message_encoding = channel.message_encoding;
  recorded.metadata = channel.metadata;
  const auto schema = schemas_.find(channel.schema_id);
  if (schema != schemas_.end()) {
    recorded.type = schema->second.name;
    recorded.schema_encoding = schema->second.encoding;
    recorded.schema = schema->second.data;
    bytes += recorded.schema.size();
  } else if (channel.schema_id != 0) {
    note(offset, "channel " + std::to_string(channel.id) + " (" + channel.topic.substr(0, 80) +
                     ") names schema " + std::to_string(channel.schema_id) +
                     ", which is not there");
  }
  count_definition(bytes);
  channel_records_.emplace(channel.id, channel);
  channel_index_[channel.id] = channels_.size();
  channels_.push_back(std::move(recorded));
}

Bytes McapReader::block_bytes(const Block& block) const {
  if (block.length > limits_.chunk_bytes) {
    throw DamagedData(block.offset, "has " + std::to_string(block.length) + " bytes, more than " +
                                        std::to_string(limits_.chunk_bytes) + " are not read");
  }
  Bytes bytes = source_->read(block.offset, static_cast<std::size_t>(block.length));
  if (!block.is_chunk) return bytes;
  ByteReader in(bytes.data(), bytes.size());
  if (in.number<std::uint8_t>() != static_cast<std::uint8_t>(Opcode::kChunk) ||
      in.number<std::uint64_t>() != block.length - kRecordHeaderBytes) {
    throw DamagedData(block.offset, "no chunk where the index has one");
  }
  const ChunkHeader header = parse_chunk_header(in);
  if (header.records_size != in.remaining()) {
    throw DamagedData(block.offset, "chunk of " + std::to_string(in.remaining()) +
                                        " bytes announces " + std::to_string(header.records_size));
  }
  if (header.uncompressed_size > limits_.chunk_bytes) {
    throw DamagedData(block.offset, "chunk announces " + std::to_string(header.uncompressed_size) +
                                        " bytes, more than " + std::to_string(limits_.chunk_bytes) +
                                        " are not read");
  }
  Bytes records = decompress(header.compression, in.here(), in.remaining(),
                             static_cast<std::size_t>(header.uncompressed_size));
  if (header.uncompressed_crc != 0 &&
      header.uncompressed_crc != crc32_of(records.data(), records.size())) {
    throw DamagedData(block.offset, "CRC of the chunk does not fit");
  }
  return records;
}

std::vector<McapReader::Entry> McapReader::entries_of(const Bytes& bytes, const Block& block,
                                                      bool scanning) {
  std::vector<Entry> entries;
  ByteReader in(bytes.data(), bytes.size());
  while (in.remaining() > 0) {
    const std::size_t at = in.position();
    try {
      const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
      ByteReader content = in.part(in.number<std::uint64_t>());
      if (opcode == Opcode::kSchema) define(parse_schema(content), block.offset);
      if (opcode == Opcode::kChannel) define(parse_channel(content), block.offset);
      if (opcode != Opcode::kMessage) continue;
      const std::size_t begin = in.position() - content.remaining(), size = content.remaining();
      const MessageHeader header = parse_message_header(content);
      const auto channel = channel_index_.find(header.channel);
      if (channel == channel_index_.end()) {
        throw DamagedData(
            at, "message on channel " + std::to_string(header.channel) + ", which is not defined");
      }
      if (scanning) {
        ++channels_[channel->second].messages;
        ++info_.messages;
        info_.start_ns =
            info_.messages == 1 ? header.log_time_ns : std::min(info_.start_ns, header.log_time_ns);
        info_.end_ns = std::max(info_.end_ns, header.log_time_ns);
      } else if (header.log_time_ns < from_ || !wanted(channel->second)) {
        continue;
      }
      entries.push_back({header.log_time_ns, begin, size});
    } catch (const DamagedData& damage) {
      if (scanning || told_.emplace(block.offset, true).second) {
        note(block.offset,
             "in the chunk, at its byte " + std::to_string(at) + ": " + damage.what());
      }
      // A record whose end is known is left out; otherwise the rest of the chunk is.
      if (in.position() <= at + kRecordHeaderBytes) break;
    }
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.log_time_ns < b.log_time_ns; });
  return entries;
}

void McapReader::load(const Block& block) {
  Loaded loaded;
  try {
    loaded.bytes = block_bytes(block);
  } catch (const DamagedData& damage) {
    if (told_.emplace(block.offset, true).second) {
      note(block.offset, std::string(damage.what()) + "; the chunk is left out");
    }
    return;
  }
  loaded.entries = entries_of(loaded.bytes, block, false);
  if (loaded.entries.empty()) return;
  loaded_bytes_ += loaded.memory();
  std::size_t slot = loaded_.size();
  if (free_slots_.empty()) {
    loaded_.emplace_back();
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  due_.push({loaded.entries.front().log_time_ns, block.offset, slot});
  loaded_[slot] = std::move(loaded);
}

bool McapReader::next(RecordedMessage& message) {
  while (next_in_order(message)) {
    if (unpack(message, name_)) return true;
  }
  return false;
}

bool McapReader::next_in_order(RecordedMessage& message) {
  if (current_slot_) {
    Loaded& last = loaded_[*current_slot_];
    if (last.next == last.entries.size()) {
      loaded_bytes_ -= last.memory();
      last = Loaded();
      free_slots_.push_back(*current_slot_);
    }
    current_slot_.reset();
  }
  while (next_block_ < blocks_.size() &&
         (due_.empty() || blocks_[next_block_].start_ns <= due_.top().log_time_ns)) {
    if (!due_.empty() && loaded_bytes_ > limits_.loaded_bytes) {
      if (!told_overlap_) {
        note(
            blocks_[next_block_].offset,
            "more chunks overlap in time than are held at once; the order of messages is not kept");
      }
      told_overlap_ = true;
      break;
    }
    const Block& block = blocks_[next_block_++];
    if (block.end_ns >= from_) load(block);
  }
  if (due_.empty()) return false;
  const Due due = due_.top();
  due_.pop();
  Loaded& loaded = loaded_[due.slot];
  const Entry& entry = loaded.entries[loaded.next++];
  if (loaded.next < loaded.entries.size()) {
    due_.push({loaded.entries[loaded.next].log_time_ns, due.block_offset, due.slot});
  }
  ByteReader in(loaded.bytes.data() + entry.offset, entry.size);
  const MessageHeader header = parse_message_header(in);
  message.channel = channel_index_.at(header.channel);
  message.sequence = header.sequence;
  message.log_time_ns = header.log_time_ns;
  message.publish_time_ns = header.publish_time_ns;
  message.data = in.here();
  message.size = in.remaining();
  current_slot_ = due.slot;
  return true;
}

void McapReader::seek(std::uint64_t log_time_ns) {
  from_ = log_time_ns;
  next_block_ = 0;
  loaded_.clear();
  free_slots_.clear();
  loaded_bytes_ = 0;
  due_ = {};
  current_slot_.reset();
}

void McapReader::verify() {
  for (const Block& block : blocks_) {
    try {
      block_bytes(block);
    } catch (const DamagedData& damage) {
      if (told_.emplace(block.offset, true).second) note(block.offset, damage.what());
    }
  }
}

}  // namespace pocd::recording
