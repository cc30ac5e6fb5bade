// The compressions that MCAP knows.
#pragma once

#include <optional>
#include <string>

#include "pocd/recording/bytes.hpp"
#include "pocd/recording/mcap_writer.hpp"

namespace pocd::recording {

/// CRC-32 (zlib's polynomial) of `size` bytes, continuing from `crc` (0 at the start).
std::uint32_t crc32_of(const std::uint8_t* data, std::size_t size, std::uint32_t crc = 0);

/// As MCAP writes it: "", "lz4" or "zstd"; and back, nothing for any other text.
std::string mcap_name(ChunkCompression compression);
std::optional<ChunkCompression> compression_named(const std::string& name);

/// `level` is zstd's. Replaces `out`. Throws InputError for a number that is no compression.
void compress(ChunkCompression compression, int level, const Bytes& in, Bytes& out);

/// `compression` is as MCAP writes it. Exactly `out_size` bytes. Throws DamagedData: unknown
/// compression, bad data, other size.
Bytes decompress(const std::string& compression, const std::uint8_t* data, std::size_t size,
                 std::size_t out_size);

/// Whether the bytes begin like a zstd frame.
bool is_zstd(const std::uint8_t* data, std::size_t size);
bool is_lz4(const std::uint8_t* data, std::size_t size);
/// A zstd frame, whether it says how long its content is or not. Throws DamagedData, also for more
/// than `most` bytes.
Bytes decompress_message(const std::uint8_t* data, std::size_t size, std::size_t most);

}  // namespace pocd::recording
