// Small recordings for tests.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "pocd/common/random.hpp"
#include "pocd/recording/mcap_reader.hpp"
#include "pocd/recording/mcap_writer.hpp"

namespace pocd::recording {

/// A folder of its own that goes with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pocd_test_XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline constexpr ChunkCompression kCompressions[] = {
    ChunkCompression::kNone, ChunkCompression::kLz4, ChunkCompression::kZstd};

inline Bytes file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return Bytes((std::istreambuf_iterator<char>(in)), {});
}

/// A message as a test compares it.
struct Kept {
  std::string topic;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::uint32_t sequence = 0;
  Bytes data;
  bool operator==(const Kept& o) const {
    return topic == o.topic && log_time_ns == o.log_time_ns &&
           publish_time_ns == o.publish_time_ns && sequence == o.sequence && data == o.data;
  }
};

inline std::vector<Kept> read_all(RecordingReader& reader) {
  std::vector<Kept> all;
  RecordedMessage m;
  while (reader.next(m)) {
    all.push_back({reader.channels()[m.channel].topic, m.log_time_ns, m.publish_time_ns, m.sequence,
                   Bytes(m.data, m.data + m.size)});
  }
  return all;
}

/// `count` messages of random sizes up to `most_bytes` on three topics, times 10 apart; returns
/// them in the order of their times.
inline std::vector<Kept> write_messages(McapWriter& writer, int count, std::size_t most_bytes,
                                        std::uint64_t seed = 1) {
  const std::uint16_t schema = writer.add_schema("std_msgs/msg/String", "ros2msg", "string data\n");
  const std::vector<std::string> topics{"/a", "/b", "pocd/c"};
  std::vector<std::uint16_t> channels;
  for (const std::string& topic : topics) {
    channels.push_back(writer.add_channel(schema, topic, "cdr", {{"qos", "x: 1"}}));
  }
  Random random(seed);
  std::vector<Kept> kept;
  for (int i = 0; i < count; ++i) {
    const std::size_t k = random.below(topics.size());
    Bytes data(random.below(most_bytes + 1));
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random.below(4));
    const auto time = static_cast<std::uint64_t>(1000 + 10 * i);
    writer.write({channels[k], static_cast<std::uint32_t>(i), time, time - 5}, data.data(),
                 data.size());
    kept.push_back({topics[k], time, time - 5, static_cast<std::uint32_t>(i), std::move(data)});
  }
  return kept;
}

inline McapReader read_memory(Bytes bytes, const ReaderLimits& limits = {}) {
  return McapReader(memory_source(std::move(bytes)), "memory", limits);
}

}  // namespace pocd::recording
