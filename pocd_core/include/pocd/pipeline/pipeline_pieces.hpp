// What a pipeline knows beside its voxels, in pieces that can be kept and put together again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pocd/map/voxel_block.hpp"

namespace pocd {

enum class PieceKind : std::uint8_t {
  kPart = 0,       ///< clocks, gates, ground, counters; the key says which
  kObject = 1,     ///< one object but for its surface, tentative ones too; the key is its id
  kSurface = 2,    ///< the surface of an object, which changes when it is seen; the key is its id
  kFreeSpace = 3,  ///< a block of cells that were seen empty; the key is the block's
  kRegion = 4      ///< when a region of the map was last looked at; the key is the region's
};
constexpr int kPieceKinds = 5;

/// Without bytes: there is no such piece any more.
struct Piece {
  PieceKind kind = PieceKind::kPart;
  std::uint64_t key = 0;
  std::vector<std::uint8_t> bytes;
  std::vector<std::size_t> sections;  ///< where bytes begin that are unlike those before
};

/// Keys of blocks and regions as keys of pieces: 21 bits per axis.
std::uint64_t piece_key(const BlockKey& key);
BlockKey block_key(std::uint64_t piece_key);

/// Number of the layout of all pieces: another one is another layout.
constexpr int kPiecesVersion = 5;

}  // namespace pocd
