// From blocks to the bytes of a tile.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pocd/map/map_delta.hpp"

namespace pocd {

/// Payload of the tile made of these 8 blocks (x fastest; null = nothing there), or nothing when it
/// has no observed voxel that is not free space.
std::vector<std::uint8_t> encode_tile(const std::array<const VoxelBlock*, 8>& blocks,
                                      int min_publish_weight);

}  // namespace pocd
