// A recording in several files.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "pocd/recording/mcap_writer.hpp"

namespace pocd::recording {

struct SplitOptions {
  McapWriterOptions mcap;
  std::uint64_t most_bytes = 0;        ///< a new file begins beyond this size; 0: never
  std::uint64_t most_duration_ns = 0;  ///< or beyond this span of log times; 0: never
  /// A ring: the oldest files are removed when all together are larger, also those that an earlier
  /// run has left, after whose last one it goes on; 0: all are kept. Needs one of the two above.
  std::uint64_t keep_bytes = 0;

  bool splits() const { return most_bytes > 0 || most_duration_ns > 0; }
};

/// Writes to `path`, or when splitting to path_0000.mcap, path_0001.mcap ... Every file is
/// complete: it has all schemas and channels, under the same numbers. A ring holds at most
/// `keep_bytes` in closed files and the present one, as long as that one is no larger itself. Not
/// thread-safe; errors as McapWriter.
class SplitWriter {
 public:
  using Write =
      std::function<void(const MessageHeader& header, const std::uint8_t* data, std::size_t size)>;

  SplitWriter(std::filesystem::path path, SplitOptions options);

  std::uint16_t add_schema(const std::string& name, const std::string& encoding,
                           const std::string& data);
  std::uint16_t add_channel(std::uint16_t schema, const std::string& topic,
                            const std::string& message_encoding,
                            const std::map<std::string, std::string>& metadata);
  void write(const MessageHeader& header, const std::uint8_t* data, std::size_t size);
  /// Writes what every file after the first begins with; it gets the log time of the message that
  /// follows.
  void set_head(std::function<void(const Write&)> head) { head_ = std::move(head); }
  /// Files that are there already and that such a writer would replace, by name.
  static std::vector<std::filesystem::path> existing(const std::filesystem::path& path,
                                                     const SplitOptions& options);
  void flush() { writer_->flush(); }
  /// Of several files, also writes metadata.yaml beside them, with which rosbag2 opens the folder;
  /// not of a ring, whose files may be of several runs.
  void close();
  /// After close(): false when there is a metadata.yaml of other files, which was left alone.
  bool listed() const { return listed_; }

  /// Of all files that there are.
  std::uint64_t bytes_written() const { return bytes_before_ + writer_->bytes_written(); }
  /// That there are; the last one is being written.
  const std::vector<std::filesystem::path>& files() const { return files_; }
  /// Of a ring: the first file that could not be removed, and why; the ring is larger by it. Else
  /// empty.
  const std::string& problem() const { return problem_; }

 private:
  struct FileCount {
    std::uint64_t start_ns = 0, end_ns = 0, messages = 0;
  };
  void open_next();
  /// Of a ring: what an earlier run has left.
  void find_earlier();
  /// Of a ring: removes the oldest files beyond its size.
  void trim();
  void count_message(const MessageHeader& header);

  std::filesystem::path path_;
  SplitOptions options_;
  std::vector<SchemaRecord> schemas_;
  std::vector<ChannelRecord> channels_;
  std::unique_ptr<McapWriter> writer_;
  std::vector<std::filesystem::path> files_;
  std::vector<FileCount> counts_;      // of each
  std::vector<std::uint64_t> closed_;  // bytes of each but the present one
  std::size_t next_number_ = 0;
  std::string problem_;
  std::map<std::uint16_t, std::uint64_t> messages_of_;
  bool listed_ = true;
  std::uint64_t bytes_before_ = 0;
  std::uint64_t first_ns_ = 0;
  bool empty_ = true;  // no message in the present file
  std::function<void(const Write&)> head_;
  std::uint64_t head_bytes_ = 0;  // of the present file; they do not count for its size
};

}  // namespace pocd::recording
