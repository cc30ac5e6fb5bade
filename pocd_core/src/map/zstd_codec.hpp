// zstd frames with bounded memory, whatever the bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pocd {

/// Level 1-3 are fast; equal input gives equal output within one zstd version.
std::vector<std::uint8_t> compress(const std::vector<std::uint8_t>& raw, int level);
/// The same, for bytes that consist of sections unlike each other, which end at `ends` (ascending;
/// what follows the last of them is one, too): each has blocks and a code of its own. Any
/// decompressor reads it.
std::vector<std::uint8_t> compress(const std::vector<std::uint8_t>& raw, int level,
                                   const std::vector<std::size_t>& ends);

/// Throws InputError naming `source` unless the bytes are exactly one zstd frame that declares a
/// content of at most `limit` bytes and holds just that.
std::vector<std::uint8_t> decompress(const std::uint8_t* data, std::size_t size, std::size_t limit,
                                     const std::string& source);

}  // namespace pocd
