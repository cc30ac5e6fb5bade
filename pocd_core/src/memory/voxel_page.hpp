// Voxels of one tile as bytes: lossless, and laid out so that they compress.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd::memory {

/// A tile is 2 x 2 x 2 blocks; block (x, y, z) of it is bit x + 2 y + 4 z of `mask`.
struct VoxelPage {
  std::uint8_t mask = 0;
  std::vector<std::uint32_t> owners;  ///< ascending, background left out
  std::vector<std::uint8_t> bytes;
};

/// `blocks` are those of the mask, in the order of its bits. `published` is the payload of the tile
/// as it is stored beside, empty where nothing is published; any tile will do, that of these voxels
/// makes the page small.
VoxelPage encode_voxels(std::uint8_t mask, const VoxelBlock* blocks,
                        const std::vector<std::uint8_t>& published);

/// Appends the blocks of the tile. `published` is what they were encoded with. Throws InputError
/// naming `source`.
void decode_voxels(const TileKey& key, std::uint8_t mask, const std::vector<std::uint8_t>& bytes,
                   const std::vector<std::uint8_t>& published, const std::string& source,
                   std::vector<VoxelBlock>& out);

/// Keys of tiles as row numbers: the 64 tiles of a region follow each other.
std::int64_t row_of(const TileKey& tile);
TileKey tile_of(std::int64_t row);
/// The first of the 64.
std::int64_t first_row_of(const BlockKey& region);

}  // namespace pocd::memory
