#include <algorithm>
#include <string_view>

#include "compression.hpp"
#include "db3_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/recording/mcap_reader.hpp"
#include "unpacked_file.hpp"

namespace pocd::recording {
namespace fs = std::filesystem;
namespace {

constexpr char kSqlite[] = "SQLite format 3";

/// Files that are given in place of a recording, by what they begin with, and what to do.
struct OtherKind {
  std::string_view magic, what;
};
constexpr OtherKind kOtherKinds[] = {
    {"#ROSBAG V", "is a bag of ROS 1: convert it (rosbags-convert) to MCAP or rosbag2"},
    {"\x04\x22\x4D\x18", "is compressed with lz4: unpack it (lz4 -d)"},
    {"\x1F\x8B", "is compressed with gzip: unpack it (gunzip, or tar -x)"},
    {"BZh", "is compressed with bzip2: unpack it (bunzip2)"},
    {"\xFD"
     "7zXZ",
     "is compressed with xz: unpack it (xz -d)"},
    {"PK\x03\x04", "is a zip archive: unpack it (unzip)"},
    {"rosbag2_bagfile_information", "is a metadata.yaml under another name"},
};

void refuse_other_kinds(const std::string& name, const ByteSource& source) {
  for (const OtherKind& kind : kOtherKinds) {
    if (source.size() < kind.magic.size()) continue;
    const Bytes start = source.read(0, kind.magic.size());
    const auto same = [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); };
    if (std::equal(start.begin(), start.end(), kind.magic.begin(), same)) {
      throw InputError(name + ": " + std::string(kind.what));
    }
  }
}

std::unique_ptr<RecordingReader> open_plain(const fs::path& file, const std::string& name,
                                            std::unique_ptr<ByteSource> source,
                                            const ReaderLimits& limits) {
  if (source->size() == 0) throw InputError(name + ": file is empty");
  if (source->size() >= sizeof kSqlite) {
    const Bytes start = source->read(0, sizeof kSqlite);
    if (std::equal(start.begin(), start.end(), std::begin(kSqlite))) {
      return open_db3(file, name, limits);
    }
  }
  refuse_other_kinds(name, *source);
  return std::make_unique<McapReader>(std::move(source), name, limits);
}

}  // namespace

std::unique_ptr<RecordingReader> open_recording(const fs::path& file, const ReaderLimits& limits) {
  std::unique_ptr<ByteSource> source = open_file_source(file);
  if (source->size() >= 4) {
    const Bytes start = source->read(0, 4);
    if (is_zstd(start.data(), start.size())) {
      // The readers hold the file open; its name is not needed any more.
      const UnpackedFile unpacked(file);
      return open_plain(unpacked.path(), file.string(), open_file_source(unpacked.path()), limits);
    }
  }
  return open_plain(file, file.string(), std::move(source), limits);
}

bool RecordingReader::unpack(RecordedMessage& message, const std::string& name) {
  const bool lz4 = is_lz4(message.data, message.size);
  if (!lz4 && !is_zstd(message.data, message.size)) return true;
  const auto left_out = [&](const std::string& why) {
    const std::string what = name + ": " + channels()[message.channel].topic;
    // Each topic once: what is wrong with one message is wrong with all.
    add_problem(what + " at " + std::to_string(message.log_time_ns) +
                    " ns: a compressed message is left out: " + why,
                left_out_.insert(message.channel).second);
    return false;
  };
  if (lz4) return left_out("lz4: of compressed messages only zstd is read (ros2 bag convert)");
  try {
    unpacked_ = decompress_message(message.data, message.size, kLargestMessage);
  } catch (const DamagedData& damage) {
    return left_out(damage.what());
  }
  message.data = unpacked_.data();
  message.size = unpacked_.size();
  return true;
}

}  // namespace pocd::recording
