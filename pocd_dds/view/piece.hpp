// What the page gets: pieces that are made and compressed once, whoever takes them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pocd/map/tile_mesh.hpp"

namespace pocd::view {

/// 4 x 4 x 4 tiles: what the page draws as one, finely or coarsely.
using ChunkKey = TileKey;
constexpr int kChunkTiles = 4;
ChunkKey chunk_of(const TileKey& tile);

enum class PieceKind : std::uint32_t {
  kJson = 1,
  kTile = 2,       ///< surface of a tile
  kChunk = 3,      ///< coarse surface of a chunk
  kChunkDone = 4,  ///< every tile of this chunk has been sent
};

/// Positions on the wire are u16 in 1/kSteps of a voxel, from the centre of the first voxel of the
/// tile or chunk: a chunk's 64 voxels end at 960.
constexpr int kSteps = 15;

/// A raw deflate stream that ends with a full flush, of a head of six little-endian 32-bit integers
/// (kind, bytes of the body, x, y, z, run) and the body. Any pieces behind each other and an empty
/// last block are a whole stream. Bodies are multiples of 4 bytes:
///   JSON: UTF-8, filled up with spaces;
///   tile, chunk: u32 vertices, u32 indices, u32 owners; the owners (u32); vertices of 12 bytes,
///   u16 x, y, z
///     and number of the owner in the list, i8 normal x, y, z (127 is 1) and u8, 1 when it is from
///     an earlier run of the publisher; the indices (u16, or u32 beyond 65535 vertices), filled up
///     with 0. Without vertices: the surface is gone.
/// docs/view.md has the same for readers of the page's protocol.
using Piece = std::shared_ptr<const std::vector<std::uint8_t>>;

Piece json_piece(const std::string& json);
Piece done_piece(const ChunkKey& chunk);

/// A mesh at an offset, as part of a piece.
struct PlacedMesh {
  const TileMesh* mesh = nullptr;
  Eigen::Vector3f offset_voxels = Eigen::Vector3f::Zero();  ///< of its first voxel in the piece
  bool earlier_run = false;
};
Piece mesh_piece(PieceKind kind, const TileKey& key, std::uint32_t run,
                 const std::vector<PlacedMesh>& meshes);

/// The message: u32 number, then the deflate stream.
std::string message_of(std::uint32_t number, const std::vector<Piece>& pieces);

}  // namespace pocd::view
