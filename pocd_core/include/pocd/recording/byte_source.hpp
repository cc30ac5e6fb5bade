// Bytes at offsets: a file, or memory.
#pragma once

#include <filesystem>
#include <memory>

#include "pocd/recording/bytes.hpp"

namespace pocd::recording {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// The bytes from `offset` to `offset + size`; throws DamagedData when they are not all there.
  virtual void read(std::uint64_t offset, std::uint8_t* out, std::size_t size) const = 0;

  Bytes read(std::uint64_t offset, std::size_t size) const {
    Bytes bytes(size);
    read(offset, bytes.data(), size);
    return bytes;
  }
};

/// Throws InputError when the file cannot be opened. A file that shrinks while it is read gives
/// DamagedData.
std::unique_ptr<ByteSource> open_file_source(const std::filesystem::path& path);
std::unique_ptr<ByteSource> memory_source(Bytes bytes);

}  // namespace pocd::recording
