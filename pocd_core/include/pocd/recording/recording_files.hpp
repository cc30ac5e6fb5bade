// The files of a recording, in their order, each opened once.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "pocd/recording/recording_reader.hpp"

namespace pocd::recording {

/// The recordings that `input` stands for: itself; of a rosbag2 folder (or its metadata.yaml) the
/// files in the order that metadata.yaml gives; of another folder its .mcap and .db3 files (also
/// .zstd) in the order of their names (numbers by value). Throws InputError when there are none, or
/// when metadata.yaml names one that is not there.
std::vector<std::filesystem::path> recording_files(const std::filesystem::path& input);

/// Readers of all files of some inputs. A file without index is read through when it is opened, so
/// they stay open, up to 64 of them. Not thread-safe.
class RecordingFiles {
 public:
  explicit RecordingFiles(const std::vector<std::filesystem::path>& inputs);

  std::size_t size() const { return paths_.size(); }
  const std::vector<std::filesystem::path>& paths() const { return paths_; }
  const std::filesystem::path& path(std::size_t file) const { return paths_[file]; }
  /// Opens it when it is not open. Valid until the next call for another file, or close().
  RecordingReader& reader(std::size_t file);
  void close(std::size_t file) { readers_[file].reset(); }

 private:
  std::vector<std::filesystem::path> paths_;
  std::vector<std::unique_ptr<RecordingReader>> readers_;
};

}  // namespace pocd::recording
