#include "pocd/recording/split_writer.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "bag_metadata.hpp"

namespace pocd::recording {

namespace {

std::filesystem::path numbered(const std::filesystem::path& path, std::size_t number) {
  char text[24];
  std::snprintf(text, sizeof text, "_%04zu", number);
  std::filesystem::path file = path;
  return file.replace_filename(path.stem().string() + text + path.extension().string());
}

}  // namespace

std::vector<std::filesystem::path> SplitWriter::existing(const std::filesystem::path& path,
                                                         const SplitOptions& options) {
  constexpr std::size_t kMostFiles = 10000;
  std::vector<std::filesystem::path> files;
  if (!options.splits()) {
    if (std::filesystem::is_regular_file(path)) files.push_back(path);
    return files;
  }
  for (std::size_t number = 0; number < kMostFiles; ++number) {
    const std::filesystem::path file = numbered(path, number);
    if (std::filesystem::exists(file)) files.push_back(file);
  }
  return files;
}

SplitWriter::SplitWriter(std::filesystem::path path, SplitOptions options)
    : path_(std::move(path)), options_(std::move(options)) {
  open_next();
}

void SplitWriter::open_next() {
  if (writer_) {
    writer_->close();
    bytes_before_ += writer_->bytes_written();
  }
  const std::filesystem::path file = options_.splits() ? numbered(path_, files_.size()) : path_;
  writer_ = std::make_unique<McapWriter>(file, options_.mcap);
  files_.push_back(file);
  counts_.push_back({});
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
  const bool large = options_.most_bytes > 0 && writer_->bytes_written() + writer_->bytes_held() >=
                                                    head_bytes_ + options_.most_bytes;
  const bool long_enough = options_.most_duration_ns > 0 && header.log_time_ns > first_ns_ &&
                           header.log_time_ns - first_ns_ >= options_.most_duration_ns;
  if (!empty_ && (large || long_enough)) {
    open_next();
    if (head_) {
      head_([&](MessageHeader first, const std::uint8_t* bytes, std::size_t count) {
        first.log_time_ns = header.log_time_ns;
        writer_->write(first, bytes, count);
        count_message(first);
      });
      head_bytes_ = writer_->bytes_written() + writer_->bytes_held();
    }
  }
  if (empty_) first_ns_ = header.log_time_ns;
  empty_ = false;
  writer_->write(header, data, size);
  count_message(header);
}

void SplitWriter::count_message(const MessageHeader& header) {
  FileCount& file = counts_.back();
  file.start_ns =
      file.messages == 0 ? header.log_time_ns : std::min(file.start_ns, header.log_time_ns);
  file.end_ns = std::max(file.end_ns, header.log_time_ns);
  ++file.messages;
  ++messages_of_[header.channel];
}

void SplitWriter::close() {
  writer_->close();
  if (!options_.splits()) return;
  BagMetadata metadata;
  metadata.schemas = schemas_;
  metadata.channels = channels_;
  metadata.messages = messages_of_;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    const FileCount& count = counts_[i];
    metadata.files.push_back({files_[i], count.start_ns, count.end_ns, count.messages});
  }
  listed_ = write_bag_metadata(path_.parent_path(), metadata);
}

}  // namespace pocd::recording
