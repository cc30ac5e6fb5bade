#include "view/piece.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "pocd/common/check.hpp"

namespace pocd::view {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Surfaces are short: higher levels take three times as long for a few percent.
constexpr int kLevel = 4;
constexpr std::size_t kHead = 24;
constexpr std::uint8_t kLastBlock[2] = {0x03, 0x00};  // final, fixed codes, nothing in it

void put32(Bytes& out, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
void put16(Bytes& out, std::uint32_t value) {
  out.push_back(static_cast<std::uint8_t>(value));
  out.push_back(static_cast<std::uint8_t>(value >> 8));
}

Piece compressed(PieceKind kind, const TileKey& key, std::uint32_t run, const Bytes& body) {
  Bytes plain;
  plain.reserve(kHead + body.size());
  put32(plain, static_cast<std::uint32_t>(kind));
  put32(plain, static_cast<std::uint32_t>(body.size()));
  put32(plain, static_cast<std::uint32_t>(key.x));
  put32(plain, static_cast<std::uint32_t>(key.y));
  put32(plain, static_cast<std::uint32_t>(key.z));
  put32(plain, run);
  plain.insert(plain.end(), body.begin(), body.end());
  z_stream stream{};
  POCD_CHECK(deflateInit2(&stream, kLevel, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  auto out = std::make_shared<Bytes>(deflateBound(&stream, plain.size()) + 16);
  stream.next_in = plain.data();
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = out->data();
  stream.avail_out = static_cast<uInt>(out->size());
  const int result = deflate(&stream, Z_FULL_FLUSH);
  out->resize(out->size() - stream.avail_out);
  deflateEnd(&stream);
  POCD_CHECK(result == Z_OK && stream.avail_in == 0);
  out->shrink_to_fit();
  return out;
}

std::uint32_t quantised(float voxels) {
  return static_cast<std::uint32_t>(std::lround(std::max(0.0f, voxels) * kSteps));
}

int floor_div(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

}  // namespace

ChunkKey chunk_of(const TileKey& tile) {
  return {floor_div(tile.x, kChunkTiles), floor_div(tile.y, kChunkTiles),
          floor_div(tile.z, kChunkTiles)};
}

Piece json_piece(const std::string& json) {
  Bytes body(json.begin(), json.end());
  body.resize((body.size() + 3) / 4 * 4, ' ');
  return compressed(PieceKind::kJson, {}, 0, body);
}

Piece done_piece(const ChunkKey& chunk) { return compressed(PieceKind::kChunkDone, chunk, 0, {}); }

Piece mesh_piece(PieceKind kind, const TileKey& key, std::uint32_t run,
                 const std::vector<PlacedMesh>& meshes) {
  std::map<std::uint32_t, std::uint32_t> number_of;
  std::vector<std::uint32_t> owners;
  std::size_t vertices = 0, indices = 0;
  for (const PlacedMesh& placed : meshes) {
    vertices += placed.mesh->vertices.size();
    indices += 3 * placed.mesh->triangles.size();
    for (const TileVertex& vertex : placed.mesh->vertices) {
      const auto next = static_cast<std::uint32_t>(owners.size());
      if (number_of.emplace(vertex.owner, next).second) owners.push_back(vertex.owner);
    }
  }
  Bytes body;
  body.reserve(12 + 4 * owners.size() + 12 * vertices + 4 * indices);
  put32(body, static_cast<std::uint32_t>(vertices));
  put32(body, static_cast<std::uint32_t>(indices));
  put32(body, static_cast<std::uint32_t>(owners.size()));
  for (const std::uint32_t owner : owners) put32(body, owner);
  for (const PlacedMesh& placed : meshes) {
    for (const TileVertex& vertex : placed.mesh->vertices) {
      const Eigen::Vector3f p = placed.offset_voxels + vertex.position_voxels;
      for (int i = 0; i < 3; ++i) put16(body, quantised(p[i]));
      put16(body, number_of[vertex.owner]);
      for (int i = 0; i < 3; ++i) {
        body.push_back(static_cast<std::uint8_t>(std::lround(127.0f * vertex.normal_W[i])));
      }
      body.push_back(placed.earlier_run ? 1 : 0);
    }
  }
  std::uint32_t first = 0;
  for (const PlacedMesh& placed : meshes) {
    for (const auto& triangle : placed.mesh->triangles) {
      for (const std::uint32_t v : triangle) {
        if (vertices > 65535) {
          put32(body, first + v);
        } else {
          put16(body, first + v);
        }
      }
    }
    first += static_cast<std::uint32_t>(placed.mesh->vertices.size());
  }
  body.resize((body.size() + 3) / 4 * 4, 0);
  return compressed(kind, key, run, body);
}

std::string message_of(std::uint32_t number, const std::vector<Piece>& pieces) {
  std::size_t bytes = 4 + sizeof kLastBlock;
  for (const Piece& piece : pieces) bytes += piece->size();
  std::string out;
  out.reserve(bytes);
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<char>(number >> (8 * i)));
  for (const Piece& piece : pieces) {
    out.append(reinterpret_cast<const char*>(piece->data()), piece->size());
  }
  out.append(reinterpret_cast<const char*>(kLastBlock), sizeof kLastBlock);
  return out;
}

}  // namespace pocd::view
