#include "pieces.hpp"

namespace pocd::view::testing {
namespace {

TileMesh triangle(std::uint32_t owner) {
  TileMesh mesh;
  for (const Eigen::Vector3f& p :
       {Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(16, 0, 0), Eigen::Vector3f(0, 8, 0.5f)}) {
    mesh.vertices.push_back({p, Eigen::Vector3f::UnitZ(), owner});
  }
  mesh.triangles.push_back({0, 1, 2});
  return mesh;
}

TEST(Piece, PiecesBehindEachOtherAreOneStream) {
  const Piece json = json_piece(R"({"a":1})"), done = done_piece({-1, 2, -3});
  const std::string message = message_of(77, {json, done, json});
  EXPECT_EQ(static_cast<unsigned char>(message[0]), 77);
  const auto pieces = read_message(message);
  ASSERT_EQ(pieces.size(), 3u);
  EXPECT_EQ(pieces[0].kind, 1u);
  EXPECT_EQ(pieces[0].body, "{\"a\":1} ");
  EXPECT_EQ(pieces[1].kind, 4u);
  EXPECT_TRUE((pieces[1].key == TileKey{-1, 2, -3}));
  EXPECT_EQ(pieces[2].body, pieces[0].body);
}

TEST(Piece, AnEmptyMessageIsAStream) { EXPECT_TRUE(read_message(message_of(1, {})).empty()); }

TEST(Piece, MeshHasItsPlacesOwnersAndRun) {
  const TileMesh a = triangle(9), b = triangle(4);
  const ReadPiece piece = read_piece(mesh_piece(PieceKind::kChunk, {1, -2, 3}, 5,
                                                {{&a, {0, 0, 0}, false}, {&b, {48, 16, 0}, true}}));
  EXPECT_EQ(piece.kind, 3u);
  EXPECT_EQ(piece.run, 5u);
  ASSERT_EQ(piece.vertices(), 6u);
  ASSERT_EQ(piece.indices(), 6u);
  ASSERT_EQ(piece.owners(), 2u);
  EXPECT_EQ(piece.owner(0), 9u);
  EXPECT_EQ(piece.owner(1), 4u);
  EXPECT_EQ(piece.at(1, 0), 16 * kSteps);
  EXPECT_EQ(piece.at(4, 0), 64 * kSteps);
  EXPECT_EQ(piece.at(5, 1), 24 * kSteps);
  EXPECT_EQ(piece.at(4, 3), 1);
  EXPECT_EQ(piece.earlier(2), 0);
  EXPECT_EQ(piece.earlier(3), 1);
  // Six indices of two bytes behind the vertices; the second mesh's begin at 3.
  const std::size_t first = 12 + 4 * 2 + 12 * 6;
  ASSERT_EQ(piece.body.size(), first + 12);
  EXPECT_EQ(piece.body[first + 6], 3);
}

TEST(Piece, ManyVerticesHaveLongIndices) {
  TileMesh big;
  big.vertices.resize(40000);
  big.triangles.push_back({0, 1, 39999});
  const ReadPiece piece = read_piece(
      mesh_piece(PieceKind::kChunk, {}, 1, {{&big, {0, 0, 0}, false}, {&big, {0, 0, 0}, false}}));
  EXPECT_EQ(piece.vertices(), 80000u);
  EXPECT_EQ(piece.body.size(), 12 + 4 + 12 * 80000u + 4 * 6);
}

TEST(Piece, ChunksOfNegativeTiles) {
  EXPECT_TRUE((chunk_of({0, 3, 4}) == ChunkKey{0, 0, 1}));
  EXPECT_TRUE((chunk_of({-1, -4, -5}) == ChunkKey{-1, -1, -2}));
}

}  // namespace
}  // namespace pocd::view::testing
