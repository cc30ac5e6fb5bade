// What there is to be shown, for any number of clients at their own pace.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "view/newest_log.hpp"
#include "view/piece.hpp"

namespace pocd::view {

/// Things of one kind that are kept by key: "status", "object/<uuid>", "event/<number>" and so on.
/// `json` is what the piece holds, for clients that read it otherwise.
struct Notice {
  std::string json;
  Piece piece;
};

/// How far one client has read. Its memory does not grow with what it misses.
struct Reading {
  std::uint64_t notices = 0, chunks = 0;
  std::uint64_t began = 0;  ///< what was forgotten up to here it cannot have heard of
  std::map<ChunkKey, std::uint64_t> tiles;  ///< of the chunks that it wants finely
};

/// Thread-safe. Written by the feed, read by the server; a slow client costs nothing.
class Board {
 public:
  /// Called, by the thread that writes, after every change.
  void set_listener(std::function<void()> changed);

  void put_notice(const std::string& key, std::string json);
  /// Nothing is said about it any more.
  void forget_notice(const std::string& key);
  struct Surfaces {
    std::vector<std::pair<TileKey, Piece>> tiles;
    std::vector<std::pair<ChunkKey, Piece>> chunks;
  };
  void put_surfaces(const Surfaces& surfaces);

  /// What the client should get next, about `bytes` at most and one piece at least if there is any:
  /// notices first, then coarse surfaces, then the tiles of `wanted`, chunk by chunk in its order.
  /// `reset` is true when the client has to forget what it knows first.
  std::vector<Piece> next(Reading& reading, const std::vector<ChunkKey>& wanted, std::size_t bytes,
                          bool& reset) const;
  /// The notices after `revision` whose key begins with one of the prefixes; moves `revision` on.
  std::vector<std::pair<std::string, std::string>> notices_after(std::uint64_t& revision,
                                                                 const std::string& prefix,
                                                                 std::size_t most) const;
  std::string notice(const std::string& key) const;
  std::size_t tile_count() const;
  std::uint64_t bytes() const;

 private:
  void changed();
  bool take_tiles(Reading& reading, const std::vector<ChunkKey>& wanted, std::size_t bytes,
                  std::size_t& taken, std::vector<Piece>& pieces) const;

  mutable std::mutex mutex_;
  std::function<void()> listener_;
  NewestLog<std::string, Notice> notices_;
  NewestLog<ChunkKey, Piece> chunks_;
  std::map<ChunkKey, NewestLog<TileKey, Piece>> tiles_;
  std::uint64_t bytes_ = 0;  // of the tiles
};

}  // namespace pocd::view
