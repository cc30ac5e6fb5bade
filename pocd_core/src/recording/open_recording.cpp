#include <algorithm>

#include "db3_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/recording/mcap_reader.hpp"

namespace pocd::recording {
namespace {

namespace fs = std::filesystem;

/// "run_2" before "run_10": digits that belong together compare by value.
bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t& at) {
      const std::size_t begin = std::min(text.find_first_not_of('0', at), text.size());
      at = begin;
      while (at < text.size() && digit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string x = number(a, i), y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

}  // namespace

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
  if (!fs::is_directory(input)) {
    if (!fs::exists(input)) throw InputError(input.string() + ": does not exist");
    return {input};
  }
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(input)) {
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
