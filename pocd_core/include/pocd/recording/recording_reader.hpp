// Messages from a recording, whoever wrote it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "pocd/recording/bytes.hpp"

namespace pocd::recording {

struct RecordedChannel {
  std::string topic;             ///< ROS topics begin with "/" and not with "rt/"
  std::string type;              ///< name of the schema: "sensor_msgs/msg/Image"
  std::string message_encoding;  ///< "cdr"
  std::string schema_encoding;   ///< "ros2msg", "omgidl", ...; "" when there is no schema
  std::string schema;            ///< its text
  std::map<std::string, std::string> metadata;
  std::uint64_t messages = 0;  ///< as the file says, or as found by reading it through
};

struct RecordedMessage {
  std::size_t channel = 0;  ///< index into channels()
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  const std::uint8_t* data = nullptr;  ///< valid until the next call of the reader
  std::size_t size = 0;
};

/// What the whole file is said (or was found) to hold.
struct RecordingInfo {
  std::string format;   ///< "mcap", "db3"
  std::string profile;  ///< "ros2" or ""
  std::string library;  ///< what wrote it, as it says
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;
  std::uint64_t chunks = 0;
  std::uint64_t start_ns = 0, end_ns = 0;  ///< log times of the first and last message
  std::map<std::string, std::uint64_t> chunks_by_compression;
  bool recovered = false;  ///< no usable index: read through from the start
};

/// Not thread-safe. Damage is not an exception: what can be read is read, and problems() says what
/// could not, with the offset.
class RecordingReader {
 public:
  virtual ~RecordingReader() = default;

  virtual const RecordingInfo& info() const = 0;
  virtual const std::vector<RecordedChannel>& channels() const = 0;
  /// Next message in the order of log times (equal ones in the order of the file); false at the
  /// end.
  virtual bool next(RecordedMessage& message) = 0;
  /// Goes on with the first message at or after the log time; 0 is the start.
  virtual void seek(std::uint64_t log_time_ns) = 0;
  /// Leaves out other channels from now on; call it before next() or seek().
  void select(std::function<bool(const RecordedChannel&)> wanted) {
    wanted_ = std::move(wanted);
    decided_.clear();
  }

  /// One line each: file, offset, what is wrong. At most kMostProblems; problem_count() is not
  /// bounded.
  const std::vector<std::string>& problems() const { return problems_; }
  std::uint64_t problem_count() const { return problem_count_; }
  static constexpr std::size_t kMostProblems = 100;

 protected:
  /// Asked once per channel.
  bool wanted(std::size_t channel) {
    while (decided_.size() <= channel) {
      decided_.push_back(!wanted_ || wanted_(channels()[decided_.size()]));
    }
    return decided_[channel];
  }
  /// `told`: it has a line of its own.
  void add_problem(const std::string& problem, bool told = true) {
    ++problem_count_;
    if (told && problems_.size() < kMostProblems) problems_.push_back(problem);
  }

  /// rosbag2 can compress messages one by one (no CDR begins like zstd): the message becomes what
  /// it was. False, with a problem that begins with `name`, when that cannot be done.
  bool unpack(RecordedMessage& message, const std::string& name);

 private:
  static constexpr std::size_t kLargestMessage = 256u << 20;

  Bytes unpacked_;
  std::set<std::size_t> left_out_;  // channels of messages that cannot be unpacked
  std::function<bool(const RecordedChannel&)> wanted_;
  std::vector<bool> decided_;  // by channel
  std::vector<std::string> problems_;
  std::uint64_t problem_count_ = 0;
};

struct ReaderLimits {
  std::uint64_t chunk_bytes = 256u << 20;    ///< a larger chunk or message is not read
  std::uint64_t loaded_bytes = 1024u << 20;  ///< chunks that overlap in time, held at once
};

/// By what the file begins with: MCAP, or SQLite for rosbag2's .db3; either may be compressed by
/// zstd as a whole. Throws InputError naming the file when it cannot be read at all or is neither.
std::unique_ptr<RecordingReader> open_recording(const std::filesystem::path& file,
                                                const ReaderLimits& limits = {});

}  // namespace pocd::recording
