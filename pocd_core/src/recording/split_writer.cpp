#include "pocd/recording/split_writer.hpp"

#include <cstdio>
#include <utility>

namespace pocd::recording {

SplitWriter::SplitWriter(std::filesystem::path path, SplitOptions options)
    : path_(std::move(path)), options_(std::move(options)) {
  open_next();
}

void SplitWriter::open_next() {
  if (writer_) {
    writer_->close();
    bytes_before_ += writer_->bytes_written();
  }
  std::filesystem::path file = path_;
  if (options_.most_bytes > 0 || options_.most_duration_ns > 0) {
    char number[16];
    std::snprintf(number, sizeof number, "_%04zu", files_.size());
    file.replace_filename(path_.stem().string() + number + path_.extension().string());
  }
  writer_ = std::make_unique<McapWriter>(file, options_.mcap);
  files_.push_back(file);
  empty_ = true;
  for (const SchemaRecord& schema : schemas_) {
    writer_->add_schema(schema.name, schema.encoding, schema.data);
  }
  for (const ChannelRecord& channel : channels_) {
    writer_->add_channel(channel.schema_id, channel.topic, channel.message_encoding,
                         channel.metadata);
  }
}

std::uint16_t SplitWriter::add_schema(const std::string& name, const std::string& encoding,
                                      const std::string& data) {
  const std::uint16_t id = writer_->add_schema(name, encoding, data);
  schemas_.push_back({id, name, encoding, data});
  return id;
}

std::uint16_t SplitWriter::add_channel(std::uint16_t schema, const std::string& topic,
                                       const std::string& message_encoding,
                                       const std::map<std::string, std::string>& metadata) {
  const std::uint16_t id = writer_->add_channel(schema, topic, message_encoding, metadata);
  channels_.push_back({id, schema, topic, message_encoding, metadata});
  return id;
}

void SplitWriter::write(const MessageHeader& header, const std::uint8_t* data, std::size_t size) {
  const bool large = options_.most_bytes > 0 &&
                     writer_->bytes_written() + writer_->bytes_held() >= options_.most_bytes;
  const bool long_enough = options_.most_duration_ns > 0 && header.log_time_ns > first_ns_ &&
                           header.log_time_ns - first_ns_ >= options_.most_duration_ns;
  if (!empty_ && (large || long_enough)) open_next();
  if (empty_) first_ns_ = header.log_time_ns;
  empty_ = false;
  writer_->write(header, data, size);
}

}  // namespace pocd::recording
