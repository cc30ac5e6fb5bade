// Writes one MCAP file.
#pragma once

#include <filesystem>
#include <memory>

#include "pocd/common/enum_words.hpp"
#include "pocd/recording/mcap_records.hpp"

namespace pocd::recording {

class OutputFile;

enum class ChunkCompression {
  kNone,
  kLz4,   ///< frame format
  kZstd,  ///< with a level
};
inline EnumWords<ChunkCompression> words_of(ChunkCompression) {
  return {{ChunkCompression::kNone, "none"},
          {ChunkCompression::kLz4, "lz4"},
          {ChunkCompression::kZstd, "zstd"}};
}

struct McapWriterOptions {
  ChunkCompression compression = ChunkCompression::kZstd;
  int level = 1;                       ///< zstd's; 1 keeps up with cameras on one core
  std::size_t chunk_bytes = 4u << 20;  ///< a chunk is written when it holds that much
};

/// A chunk reaches the file whole and with every schema and channel it needs, in one write:
/// whatever happens to the process, all chunks before it can be read. Not thread-safe.
class McapWriter {
 public:
  /// Throws InputError: the file cannot be created, or no such compression.
  explicit McapWriter(const std::filesystem::path& path, McapWriterOptions options = {});
  /// Closes; errors are lost, so call close().
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Number of the schema, from 1. `data` is text for the encodings ros2msg and omgidl.
  std::uint16_t add_schema(const std::string& name, const std::string& encoding,
                           const std::string& data);
  /// Number of the channel, from 0; `schema` 0: none.
  std::uint16_t add_channel(std::uint16_t schema, const std::string& topic,
                            const std::string& message_encoding,
                            const std::map<std::string, std::string>& metadata);
  /// Throws InputError when the chunk cannot be written: the file is closed then, with an index of
  /// all chunks before; or when the message is larger than readers take (kLargestMessage).
  void write(const MessageHeader& header, const std::uint8_t* data, std::size_t size);
  /// Writes what is held as a chunk; throws like write().
  void flush();
  /// Writes the rest and the summary. Throws InputError. Nothing may be written afterwards.
  void close();

  bool is_open() const { return open_; }
  /// Bytes in the file, and those held for the next chunk.
  std::uint64_t bytes_written() const;
  std::size_t bytes_held() const { return chunk_.size(); }
  const StatisticsRecord& statistics() const { return statistics_; }

  static constexpr std::size_t kLargestMessage = 255u << 20;

 private:
  void define(std::uint16_t channel);
  void finish();
  std::uint64_t summary_bound() const;

  McapWriterOptions options_;
  std::unique_ptr<OutputFile> file_;
  bool open_ = true;
  std::vector<SchemaRecord> schemas_;
  std::vector<ChannelRecord> channels_;
  std::uint64_t definition_bytes_ = 0;

  // The chunk being filled.
  Bytes chunk_;
  std::vector<bool> defined_;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index_;
  std::uint64_t start_ns_ = 0, end_ns_ = 0;

  Bytes chunk_indexes_;  // records for the summary
  StatisticsRecord statistics_;
};

}  // namespace pocd::recording
