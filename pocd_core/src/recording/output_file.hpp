// A file that only grows, and stays whole when it cannot.
#pragma once

#include <filesystem>

#include "pocd/recording/bytes.hpp"

namespace pocd::recording {

class OutputFile {
 public:
  /// Creates or empties the file. Throws InputError.
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Makes sure of room for `bytes` after the end, where the file system can promise that. Throws
  /// InputError when there is none.
  void reserve(std::uint64_t bytes);
  /// All or nothing: throws InputError with the file as it was before.
  void append(const Bytes& bytes);
  /// Gives back what is still reserved. Throws InputError.
  void close();

  std::uint64_t size() const { return size_; }
  std::uint32_t crc() const { return crc_; }  ///< of everything written
  const std::filesystem::path& path() const { return path_; }

 private:
  [[noreturn]] void fail(const char* what, int error) const;

  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace pocd::recording
