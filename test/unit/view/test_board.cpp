#include "view/board.hpp"

#include <gtest/gtest.h>

#include <map>
#include <optional>

#include "pieces.hpp"
#include "pocd/common/random.hpp"

namespace pocd::view::testing {
namespace {

std::vector<ReadPiece> read(const std::vector<Piece>& pieces) {
  return read_message(message_of(1, pieces));
}

Piece tile_piece(const TileKey& key, std::uint32_t run) {
  return mesh_piece(PieceKind::kTile, key, run, {});
}

TEST(Board, OnlyTheNewestOfEachKeyIsSent) {
  Board board;
  for (int i = 0; i < 1000; ++i) board.put_notice("status", "{\"n\":" + std::to_string(i) + "}");
  board.put_notice("object/a", "{}");
  Reading reading;
  bool reset = false;
  const auto pieces = read(board.next(reading, {}, 1 << 20, reset));
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[0].body.substr(0, 9), "{\"n\":999}");
  EXPECT_TRUE(board.next(reading, {}, 1 << 20, reset).empty());
  EXPECT_FALSE(reset);
}

TEST(Board, WhoMissedWhatIsForgottenBeginsAnew) {
  Board board;
  board.put_notice("object/a", "{}");
  board.put_notice("object/b", "{}");
  Reading behind, up_to_date, fresh;
  bool reset = false;
  board.next(behind, {}, 1, reset);  // one piece at least: the first
  EXPECT_EQ(behind.notices, 1u);
  board.next(up_to_date, {}, 1 << 20, reset);
  board.forget_notice("object/b");
  board.put_notice("object/c", "{}");
  EXPECT_EQ(board.next(behind, {}, 1 << 20, reset).size(), 2u);  // a again, and c
  EXPECT_TRUE(reset);
  EXPECT_EQ(board.next(up_to_date, {}, 1 << 20, reset).size(), 1u);
  EXPECT_FALSE(reset);
  EXPECT_EQ(board.next(fresh, {}, 1 << 20, reset).size(), 2u);
  EXPECT_FALSE(reset);
}

TEST(Board, TilesOfWantedChunksOnlyAndThenThatTheyAreDone) {
  Board board;
  Board::Surfaces surfaces;
  for (int x = 0; x < 8; ++x)
    surfaces.tiles.emplace_back(TileKey{x, 0, 0}, tile_piece({x, 0, 0}, 1));
  board.put_surfaces(surfaces);
  Reading reading;
  bool reset = false;
  EXPECT_TRUE(board.next(reading, {}, 1 << 20, reset).empty());
  const auto pieces = read(board.next(reading, {{1, 0, 0}}, 1 << 20, reset));
  ASSERT_EQ(pieces.size(), 5u);
  EXPECT_EQ(pieces[0].key.x, 4);
  EXPECT_EQ(pieces[4].kind, static_cast<std::uint32_t>(PieceKind::kChunkDone));
}

// A client that reads at random times, random amounts and random chunks of a board that changes at
// random has in the end what the board has.
TEST(Board, EveryReaderEndsWithTheNewest) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Board board;
    std::map<std::string, std::string> truth;
    std::map<TileKey, std::uint32_t> tiles;
    struct Client {
      Reading reading;
      std::vector<ChunkKey> wanted;
      std::map<std::string, std::string> notices;
      std::map<TileKey, std::uint32_t> tiles;
    };
    std::vector<Client> clients(4);
    const auto take = [&](Client& client, std::size_t bytes) {
      bool reset = false;
      const auto pieces = board.next(client.reading, client.wanted, bytes, reset);
      if (reset) {
        client.notices.clear();
        client.tiles.clear();
      }
      for (const ReadPiece& piece : read(pieces)) {
        if (piece.kind == 1) client.notices[piece.body.substr(0, 6)] = piece.body;
        if (piece.kind == 2) client.tiles[piece.key] = piece.run;
      }
      return !pieces.empty();
    };
    for (std::uint32_t step = 1; step <= 400; ++step) {
      const std::string name = "key_" + std::to_string(10 + random.below(30));
      if (random.uniform() < 0.1) {
        board.forget_notice(name);
        truth.erase(name);
      } else {
        truth[name] = name + ' ' + std::to_string(step);
        board.put_notice(name, truth[name]);
      }
      const TileKey key{static_cast<std::int32_t>(random.below(16)), 0, 0};
      tiles[key] = step;
      Board::Surfaces surfaces;
      surfaces.tiles.emplace_back(key, tile_piece(key, step));
      board.put_surfaces(surfaces);
      Client& client = clients[random.below(clients.size())];
      if (random.uniform() < 0.2) {
        client.wanted = {{static_cast<std::int32_t>(random.below(4)), 0, 0}};
        client.reading.tiles.clear();  // as a session does with what is not wanted any more
      }
      if (random.uniform() < 0.5) take(client, 1 + random.below(200));
    }
    for (Client& client : clients) {
      client.wanted = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
      int takes = 0;
      while (take(client, 1 + random.below(300))) {
        ASSERT_LT(++takes, 1000) << "begins anew for ever, seed " << seed;
      }
      for (const auto& [name, text] : truth) {
        EXPECT_EQ(client.notices[name].substr(0, text.size()), text) << "seed " << seed;
      }
      EXPECT_EQ(client.tiles, tiles) << "seed " << seed;
    }
  }
}

// The same of clients that jump between times and back to now; at the end each shows the map of the
// time that it has chosen last.
TEST(Board, EveryReaderShowsTheMapOfItsTime) {
  constexpr StampNs kSecond = 1000000000;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Board board;
    board.map_known_from(kSecond);
    std::map<StampNs, std::map<TileKey, std::uint32_t>> truth;  // by the time from which it holds
    truth[kSecond] = {};
    struct Client {
      Reading reading;
      std::optional<StampNs> at;
      std::map<TileKey, std::uint32_t> tiles;  // those of a surface with run 0 are not there
    };
    std::vector<Client> clients(4);
    const std::vector<ChunkKey> wanted{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    const auto take = [&](Client& client, std::size_t bytes) {
      bool reset = false;
      const auto pieces = board.next(client.reading, wanted, bytes, reset);
      for (const ReadPiece& piece : read(pieces)) {
        if (piece.kind != 2) continue;
        client.tiles[piece.key] = piece.run;
        if (piece.run == 0) client.tiles.erase(piece.key);
      }
      return !pieces.empty();
    };
    for (std::uint32_t step = 1; step <= 200; ++step) {
      const StampNs now = step * kSecond;
      const TileKey key{static_cast<std::int32_t>(random.below(16)), 0, 0};
      auto map = truth.rbegin()->second;
      map[key] = step;
      truth[now] = map;
      Board::Surfaces surfaces;
      surfaces.tiles.emplace_back(key, tile_piece(key, step));
      board.put_surfaces(surfaces, now);
      Client& client = clients[random.below(clients.size())];
      if (random.uniform() < 0.3) {
        client.at.reset();
        if (random.uniform() < 0.7)
          client.at = static_cast<StampNs>(1 + random.below(step)) * kSecond;
        EXPECT_TRUE(board.show_at(client.reading, client.at));
      }
      if (random.uniform() < 0.5) take(client, 1 + random.below(200));
    }
    for (Client& client : clients) {
      int takes = 0;
      while (take(client, 1 + random.below(300))) ASSERT_LT(++takes, 1000) << "seed " << seed;
      const auto shown =
          client.at ? std::prev(truth.upper_bound(*client.at)) : std::prev(truth.end());
      EXPECT_EQ(client.tiles, shown->second)
          << "seed " << seed << ", at " << client.at.value_or(-1);
    }
  }
}

TEST(Board, WhatIsNotKnownOfThenIsTheMapOfNow) {
  Board board(0);  // keeps nothing that was replaced
  const TileKey key{0, 0, 0};
  Reading reading;
  EXPECT_FALSE(board.show_at(reading, 5));  // nothing yet
  board.map_known_from(1000000000);
  for (std::uint32_t run = 1; run <= 3; ++run) {
    Board::Surfaces surfaces;
    surfaces.tiles.emplace_back(key, tile_piece(key, run));
    board.put_surfaces(surfaces, run * StampNs{10000000000});
  }
  EXPECT_EQ(board.map_known_since(), StampNs{30000000000});
  EXPECT_FALSE(board.show_at(reading, StampNs{20000000000}));
  EXPECT_TRUE(board.show_at(reading, StampNs{30000000000}));
}

// A place that changes all the time costs no more than a thousand versions per known time.
TEST(PastSurfaces, VersionsThatFollowCloselyAreOne) {
  PastSurfaces past;
  past.known_from(0);
  const TileKey key{1, 2, 3};
  std::uint64_t revision = 0;
  for (StampNs stamp = 0; stamp < 100000; ++stamp) {
    past.put_tile(key, ++revision, tile_piece(key, 1), stamp * 1000000000);
  }
  const auto& versions = past.tiles(chunk_of(key))->at(key);
  EXPECT_LT(versions.size(), 8000u);
  EXPECT_EQ(versions.back().revision, revision);
  // What is shown is never older than what held at that time, and newer by a thousandth at most.
  const auto* at = PastSurfaces::at(versions, 50000 * StampNs{1000000000});
  ASSERT_NE(at, nullptr);
  EXPECT_GE(at->revision, 50001u);
  EXPECT_LE(at->revision, 50001u + 100);
}

TEST(Board, TellsWhoListens) {
  Board board;
  int told = 0;
  board.set_listener([&] { ++told; });
  board.put_notice("a", "{}");
  board.put_surfaces({});
  board.set_listener(nullptr);
  board.put_notice("b", "{}");
  EXPECT_EQ(told, 2);
}

}  // namespace
}  // namespace pocd::view::testing
