// Pieces as a page reads them.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <string>
#include <vector>

#include "view/piece.hpp"

namespace pocd::view::testing {

struct ReadPiece {
  std::uint32_t kind = 0, run = 0;
  TileKey key;
  std::string body;

  std::uint32_t word(std::size_t i) const {
    std::uint32_t value = 0;
    std::memcpy(&value, body.data() + 4 * i, 4);
    return value;
  }
  std::uint32_t vertices() const { return word(0); }
  std::uint32_t indices() const { return word(1); }
  std::uint32_t owners() const { return word(2); }
  std::uint32_t owner(std::size_t i) const { return word(3 + i); }
  std::uint16_t at(std::size_t vertex, int field) const {  // x, y, z, owner
    std::uint16_t value = 0;
    std::memcpy(&value, body.data() + 12 + 4 * owners() + 12 * vertex + 2 * field, 2);
    return value;
  }
  std::uint8_t earlier(std::size_t vertex) const {
    return static_cast<std::uint8_t>(body[12 + 4 * owners() + 12 * vertex + 11]);
  }
};

/// The pieces of a message, as one deflate stream that has to end.
inline std::vector<ReadPiece> read_message(const std::string& message) {
  std::string plain;
  z_stream stream{};
  inflateInit2(&stream, -15);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(message.data() + 4));
  stream.avail_in = static_cast<uInt>(message.size() - 4);
  std::vector<Bytef> part(1 << 16);
  int result = Z_OK;
  while (result == Z_OK) {
    stream.next_out = part.data();
    stream.avail_out = static_cast<uInt>(part.size());
    result = inflate(&stream, Z_NO_FLUSH);
    plain.append(part.begin(), part.end() - stream.avail_out);
  }
  EXPECT_EQ(result, Z_STREAM_END);
  EXPECT_EQ(stream.avail_in, 0u);
  inflateEnd(&stream);
  std::vector<ReadPiece> pieces;
  for (std::size_t at = 0; at < plain.size();) {
    std::uint32_t head[6];
    std::memcpy(head, plain.data() + at, sizeof head);
    ReadPiece piece;
    piece.kind = head[0];
    piece.key = {static_cast<std::int32_t>(head[2]), static_cast<std::int32_t>(head[3]),
                 static_cast<std::int32_t>(head[4])};
    piece.run = head[5];
    EXPECT_EQ(head[1] % 4, 0u);
    piece.body = plain.substr(at + sizeof head, head[1]);
    at += sizeof head + head[1];
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

inline ReadPiece read_piece(const Piece& piece) {
  return read_message(message_of(1, {piece})).at(0);
}

}  // namespace pocd::view::testing
