#include <algorithm>

#include "compression.hpp"
#include "db3_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/recording/mcap_reader.hpp"
#include "unpacked_file.hpp"

namespace pocd::recording {
namespace fs = std::filesystem;
namespace {

constexpr char kSqlite[] = "SQLite format 3";

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
  if (!is_zstd(message.data, message.size)) return true;
  try {
    unpacked_ = decompress_message(message.data, message.size, kLargestMessage);
  } catch (const DamagedData& damage) {
    add_problem(name + ": " + channels()[message.channel].topic + " at " +
                std::to_string(message.log_time_ns) +
                " ns: a compressed message is left out: " + damage.what());
    return false;
  }
  message.data = unpacked_.data();
  message.size = unpacked_.size();
  return true;
}

}  // namespace pocd::recording
