#include "pocd/recording/recording_files.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd/common/natural_order.hpp"

namespace pocd::recording {
namespace fs = std::filesystem;
namespace {

constexpr char kMetadata[] = "metadata.yaml";
constexpr std::ptrdiff_t kMostOpen = 64;

/// What the list names, wherever it was made; rosbag2 and its users add and take away `.zstd`.
fs::path file_beside(const fs::path& metadata, const std::string& name) {
  const fs::path file = metadata.parent_path() / fs::path(name).filename();
  if (fs::exists(file)) return file;
  const fs::path packed = file.string() + ".zstd";
  if (fs::exists(packed)) return packed;
  const fs::path unpacked = metadata.parent_path() / file.stem();
  if (file.extension() == ".zstd" && fs::exists(unpacked)) return unpacked;
  throw InputError(metadata.string() + ": names " + file.filename().string() +
                   ", which is not in the folder; give the files that are there themselves");
}

/// Throws InputError for a compression that only its plugin undoes.
void check_compression(const YAML::Node& bag, const fs::path& metadata) {
  const auto text = [&](const char* key) {
    return bag[key] && bag[key].IsScalar() ? bag[key].as<std::string>() : std::string();
  };
  const std::string format = text("compression_format"), mode = text("compression_mode");
  if (mode.empty() || mode == "NONE" || mode == "none") return;
  if (format.empty() || format == "none" || format == "zstd") return;
  throw InputError(metadata.string() + ": compression_format is \"" + format +
                   "\", only zstd is read: convert it (ros2 bag convert, without compression)");
}

/// rosbag2's own list; older ones name the files as seen from beside the folder. Nothing when the
/// file is no such list.
std::vector<fs::path> listed_files(const fs::path& metadata) {
  std::vector<fs::path> files;
  try {
    const YAML::Node top = YAML::LoadFile(metadata.string());
    if (!top.IsMap() || !top["rosbag2_bagfile_information"].IsMap()) return files;
    const YAML::Node bag = top["rosbag2_bagfile_information"];
    check_compression(bag, metadata);
    for (const YAML::Node& name : bag["relative_file_paths"]) {
      files.push_back(file_beside(metadata, name.as<std::string>()));
    }
  } catch (const YAML::Exception& error) {
    throw InputError(metadata.string() + ": cannot be read: " + error.what());
  }
  return files;
}

bool is_recording(const fs::path& file) {
  const fs::path name = file.extension() == ".zstd" ? file.stem() : file.filename();
  return name.extension() == ".mcap" || name.extension() == ".db3";
}

}  // namespace

std::vector<fs::path> recording_files(const fs::path& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (status.type() == fs::file_type::not_found) {
    throw InputError(input.string() + ": does not exist");
  }
  if (error) throw InputError(input.string() + ": cannot be read: " + error.message());
  if (!fs::is_directory(status)) {
    if (input.filename() != kMetadata) return {input};
    const std::vector<fs::path> listed = listed_files(input);
    if (listed.empty()) throw InputError(input.string() + ": names no recordings");
    return listed;
  }
  if (fs::exists(input / kMetadata, error)) {
    const std::vector<fs::path> listed = listed_files(input / kMetadata);
    if (!listed.empty()) return listed;
  }
  std::vector<fs::path> files;
  fs::directory_iterator entries(input, error);
  if (error) throw InputError(input.string() + ": cannot be read: " + error.message());
  for (const fs::directory_entry& entry : entries) {
    if (is_recording(entry.path())) files.push_back(entry.path());
  }
  if (files.empty()) {
    throw InputError(input.string() + ": no .mcap or .db3 file in it (nor .zstd of such)");
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

RecordingFiles::RecordingFiles(const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    for (fs::path& file : recording_files(input)) paths_.push_back(std::move(file));
  }
  readers_.resize(paths_.size());
}

RecordingReader& RecordingFiles::reader(std::size_t file) {
  if (readers_[file]) return *readers_[file];
  const auto is_open = [](const auto& reader) { return reader != nullptr; };
  if (std::count_if(readers_.begin(), readers_.end(), is_open) >= kMostOpen) {
    // The last one: it is the one that is used last.
    std::find_if(readers_.rbegin(), readers_.rend(), is_open)->reset();
  }
  readers_[file] = open_recording(paths_[file]);
  return *readers_[file];
}

}  // namespace pocd::recording
