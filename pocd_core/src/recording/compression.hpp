// The compressions that MCAP knows.
#pragma once

#include <string>

#include "pocd/recording/bytes.hpp"

namespace pocd::recording {

/// CRC-32 (zlib's polynomial) of `size` bytes, continuing from `crc` (0 at the start).
std::uint32_t crc32_of(const std::uint8_t* data, std::size_t size, std::uint32_t crc = 0);

/// `compression` is "", "lz4" (frame format) or "zstd"; `level` is zstd's. Replaces `out`.
void compress(const std::string& compression, int level, const Bytes& in, Bytes& out);

/// Exactly `out_size` bytes. Throws DamagedData: unknown compression, bad data, other size.
Bytes decompress(const std::string& compression, const std::uint8_t* data, std::size_t size,
                 std::size_t out_size);

/// Whether the bytes begin like a zstd frame.
bool is_zstd(const std::uint8_t* data, std::size_t size);
bool is_lz4(const std::uint8_t* data, std::size_t size);
/// A zstd frame, whether it says how long its content is or not. Throws DamagedData, also for more
/// than `most` bytes.
Bytes decompress_message(const std::uint8_t* data, std::size_t size, std::size_t most);

}  // namespace pocd::recording
