// Surfaces of the tiles that changed, finely per tile and coarsely per chunk.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <set>
#include <unordered_map>

#include "view/board.hpp"

namespace pocd::view {

/// Tiles of an earlier run of the publisher stay, marked as such, until the present run has the
/// tile: nobody has looked there since. Not thread-safe.
class SurfaceMaker {
 public:
  /// The map as it is now. `run` counts the runs of the publisher from 1.
  void update(std::map<TileKey, MapTile> tiles, std::uint32_t run, double voxel_size_m,
              double truncation_m);

  /// Draws about `most` of the tiles that have changed, whole chunks at a time, and the chunks.
  /// Empty when there is nothing left.
  Board::Surfaces make(std::size_t most);
  bool idle() const { return dirty_tiles_.empty() && dirty_chunks_.empty(); }

  std::uint64_t drawn() const { return drawn_; }
  std::uint64_t unreadable() const { return unreadable_; }  ///< tiles whose payload is no tile
  std::size_t earlier_tiles() const { return earlier_; }    ///< not seen in this run

 private:
  struct Drawn {
    Piece piece;
    TileMesh coarse;
    std::uint32_t run = 0;
  };
  const DecodedTile* decoded(const TileKey& key);
  void draw(const TileKey& key, Board::Surfaces& out);
  void draw_chunk(const ChunkKey& chunk, Board::Surfaces& out);
  void touch(const TileKey& key);

  std::map<TileKey, MapTile> tiles_;
  std::uint32_t run_ = 0;
  double voxel_size_m_ = 0.0, truncation_m_ = 0.0;
  std::map<ChunkKey, std::set<TileKey>> dirty_tiles_;
  std::set<ChunkKey> dirty_chunks_;
  std::map<ChunkKey, std::map<TileKey, Drawn>> drawn_tiles_;
  std::map<ChunkKey, Piece> chunk_pieces_;
  std::uint64_t drawn_ = 0, unreadable_ = 0;
  std::size_t earlier_ = 0;

  // The tiles that were decoded last, newest first.
  struct Decoded {
    TileKey key;
    DecodedTile tile;
  };
  std::list<Decoded> decoded_;
  std::unordered_map<TileKey, std::list<Decoded>::iterator, BlockKeyHash> decoded_at_;
  std::set<TileKey> bad_;
};

}  // namespace pocd::view
