#include <algorithm>

#include "db3_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/natural_order.hpp"
#include "pocd/recording/mcap_reader.hpp"

namespace pocd::recording {
namespace fs = std::filesystem;

std::unique_ptr<RecordingReader> open_recording(const fs::path& file, const ReaderLimits& limits) {
  constexpr char kSqlite[] = "SQLite format 3";
  std::unique_ptr<ByteSource> source = open_file_source(file);
  if (source->size() == 0) throw InputError(file.string() + ": file is empty");
  if (source->size() >= sizeof kSqlite) {
    const Bytes start = source->read(0, sizeof kSqlite);
    if (std::equal(start.begin(), start.end(), std::begin(kSqlite))) {
      return open_db3(file, limits);
    }
  }
  return std::make_unique<McapReader>(std::move(source), file.string(), limits);
}

std::vector<fs::path> recording_files(const fs::path& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (status.type() == fs::file_type::not_found) {
    throw InputError(input.string() + ": does not exist");
  }
  if (error) throw InputError(input.string() + ": cannot be read: " + error.message());
  if (!fs::is_directory(status)) return {input};
  std::vector<fs::path> files;
  fs::directory_iterator entries(input, error);
  if (error) throw InputError(input.string() + ": cannot be read: " + error.message());
  for (const fs::directory_entry& entry : entries) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".mcap" || extension == ".db3") files.push_back(entry.path());
  }
  if (files.empty()) throw InputError(input.string() + ": no .mcap or .db3 file in it");
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

}  // namespace pocd::recording
