// A file that is compressed as a whole, as rosbag2 does with compression_mode FILE.
#pragma once

#include <filesystem>

namespace pocd::recording {

/// The content of a .zstd file in a temporary file, for as long as the object lives.
class UnpackedFile {
 public:
  /// Throws InputError: cannot be read, is damaged, or the temporary folder has no room.
  explicit UnpackedFile(const std::filesystem::path& file);
  ~UnpackedFile();
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace pocd::recording
