#include "view/surface_maker.hpp"

#include "pocd/common/check.hpp"

namespace pocd::view {
namespace {

// One cube inside of a tile, and what lies on its sides: every 0.4 m with voxels of 0.05 m.
constexpr int kCoarseVoxels = 16;
// 36 KB each. A tile needs its neighbours, of which most are needed again soon.
constexpr std::size_t kMostDecoded = 512;

bool equal(const Piece& a, const Piece& b) { return a && b && *a == *b; }

}  // namespace

void SurfaceMaker::touch(const TileKey& key) {
  for (const TileKey& neighbour : tiles_drawn_with(key)) {
    if (tiles_.count(neighbour) > 0 || neighbour == key) {
      dirty_tiles_[chunk_of(neighbour)].insert(neighbour);
    }
  }
  const auto known = decoded_at_.find(key);
  if (known == decoded_at_.end()) return;
  decoded_.erase(known->second);
  decoded_at_.erase(known);
}

void SurfaceMaker::update(std::map<TileKey, MapTile> tiles, std::uint32_t run, double voxel_size_m,
                          double truncation_m) {
  const bool new_run = run != run_;
  std::map<TileKey, MapTile> before = std::move(tiles_);
  tiles_ = std::move(tiles);
  voxel_size_m_ = voxel_size_m;
  truncation_m_ = truncation_m;
  run_ = run;
  if (new_run) {
    decoded_.clear();
    decoded_at_.clear();
    bad_.clear();
    for (const auto& [chunk, drawn] : drawn_tiles_) dirty_chunks_.insert(chunk);
  }
  for (const auto& [key, tile] : tiles_) {
    const auto old = before.find(key);
    if (new_run || old == before.end() || old->second.version != tile.version ||
        old->second.payload != tile.payload) {
      touch(key);
    }
  }
  if (!new_run) {
    for (const auto& [key, tile] : before) {
      if (tiles_.count(key) == 0) touch(key);
    }
  }
  earlier_ = 0;
  for (const auto& [chunk, drawn] : drawn_tiles_) {
    for (const auto& [key, surface] : drawn) {
      earlier_ += surface.run != run_ && tiles_.count(key) == 0;
    }
  }
}

const DecodedTile* SurfaceMaker::decoded(const TileKey& key) {
  const auto known = decoded_at_.find(key);
  if (known != decoded_at_.end()) {
    decoded_.splice(decoded_.begin(), decoded_, known->second);
    return &known->second->tile;
  }
  const auto tile = tiles_.find(key);
  if (tile == tiles_.end()) return nullptr;
  try {
    decoded_.push_front({key, decode_tile(tile->second.payload, truncation_m_)});
  } catch (const InputError&) {
    unreadable_ += bad_.insert(key).second;
    return nullptr;
  }
  decoded_at_[key] = decoded_.begin();
  return &decoded_.front().tile;
}

Board::Surfaces SurfaceMaker::make(std::size_t most) {
  Board::Surfaces out;
  std::size_t done = 0;
  while (done < most && !dirty_tiles_.empty()) {
    const auto first = dirty_tiles_.begin();
    for (const TileKey& key : first->second) draw(key, out);
    done += first->second.size();
    dirty_chunks_.insert(first->first);
    dirty_tiles_.erase(first);
    // A lookup of the next tile must not throw out what the present one still reads: only here.
    while (decoded_.size() > kMostDecoded) {
      decoded_at_.erase(decoded_.back().key);
      decoded_.pop_back();
    }
  }
  for (const ChunkKey& chunk : dirty_chunks_) draw_chunk(chunk, out);
  dirty_chunks_.clear();
  drawn_ += done;
  return out;
}

void SurfaceMaker::draw(const TileKey& key, Board::Surfaces& out) {
  auto& chunk = drawn_tiles_[chunk_of(key)];
  const auto known = chunk.find(key);
  const TileMesh mesh =
      extract_tile_mesh(key, voxel_size_m_, [&](const TileKey& k) { return decoded(k); });
  if (mesh.vertices.empty()) {
    if (known == chunk.end()) return;
    chunk.erase(known);
    out.tiles.emplace_back(key, mesh_piece(PieceKind::kTile, key, run_, {}));
    return;
  }
  Piece piece = mesh_piece(PieceKind::kTile, key, run_, {{&mesh, Eigen::Vector3f::Zero(), false}});
  if (known != chunk.end() && equal(known->second.piece, piece)) return;
  out.tiles.emplace_back(key, piece);
  chunk[key] = {std::move(piece), coarsened(mesh, kCoarseVoxels), run_};
}

void SurfaceMaker::draw_chunk(const ChunkKey& chunk, Board::Surfaces& out) {
  std::vector<PlacedMesh> meshes;
  for (const auto& [key, drawn] : drawn_tiles_[chunk]) {
    const Eigen::Vector3i in_chunk(key.x - kChunkTiles * chunk.x, key.y - kChunkTiles * chunk.y,
                                   key.z - kChunkTiles * chunk.z);
    meshes.push_back({&drawn.coarse, (kTileSide * in_chunk).cast<float>(), drawn.run != run_});
  }
  Piece piece = mesh_piece(PieceKind::kChunk, chunk, run_, meshes);
  Piece& before = chunk_pieces_[chunk];
  if (equal(before, piece)) return;
  before = piece;
  out.chunks.emplace_back(chunk, std::move(piece));
}

}  // namespace pocd::view
