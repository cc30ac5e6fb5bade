#include "pocd/recording/split_writer.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "bag_metadata.hpp"
#include "pocd/common/check.hpp"

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
  POCD_CHECK(options_.keep_bytes == 0 || options_.splits());
  if (options_.keep_bytes > 0) find_earlier();
  open_next();
}

void SplitWriter::find_earlier() {
  const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
  std::map<std::size_t, std::filesystem::path> earlier;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().stem().string(), stem = path_.stem().string() + "_";
    if (entry.path().extension() != path_.extension() || name.rfind(stem, 0) != 0) continue;
    const std::string digits = name.substr(stem.size());
    // As numbered() writes it, and no more than it will ever come to.
    if (digits.size() < 4 || digits.size() > 9 ||
        digits.find_first_not_of("0123456789") != std::string::npos) {
      continue;
    }
    earlier[std::stoul(digits)] = entry.path();
  }
  for (const auto& [number, file] : earlier) {
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    files_.push_back(file);
    counts_.push_back({});
    closed_.push_back(error ? 0 : bytes);
    bytes_before_ += closed_.back();
    next_number_ = number + 1;
  }
}

void SplitWriter::trim() {
  while (!closed_.empty() && bytes_written() > options_.keep_bytes) {
    std::error_code error;
    std::filesystem::remove(files_.front(), error);  // one that is gone already is no error
    if (error && problem_.empty()) {
      problem_ =
          files_.front().string() + ": cannot be removed, the ring is larger: " + error.message();
    }
    bytes_before_ -= closed_.front();
    closed_.erase(closed_.begin());
    files_.erase(files_.begin());
    counts_.erase(counts_.begin());
  }
}

void SplitWriter::open_next() {
  if (writer_) {
    writer_->close();
    closed_.push_back(writer_->bytes_written());
    bytes_before_ += closed_.back();
  }
  const std::filesystem::path file = options_.splits() ? numbered(path_, next_number_++) : path_;
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
  if (options_.keep_bytes > 0) trim();
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
  if (!options_.splits() || options_.keep_bytes > 0) return;
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
