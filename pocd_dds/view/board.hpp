// What there is to be shown, for any number of clients at their own pace.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "view/newest_log.hpp"
#include "view/past_surfaces.hpp"
#include "view/piece.hpp"

namespace pocd::view {

/// Things of one kind that are kept by key: "status", "object/<uuid>", "event/<number>" and so on.
/// `json` is what the piece holds, for clients that read it otherwise.
struct Notice {
  std::string json;
  Piece piece;
};

/// What a client has of the map that shows another time, or comes back from it: the revision of
/// each surface, 0 for none.
struct ReadingThen {
  std::optional<StampNs> at;  ///< nothing: on the way back to now
  bool complete = false;      ///< it has all there is to have
  std::map<ChunkKey, std::uint64_t> chunks;
  std::map<ChunkKey, std::map<TileKey, std::uint64_t>> tiles;  ///< of the chunks it wants finely
  std::set<ChunkKey> done;                                     ///< and has
};

/// How far one client has read. Its memory does not grow with what it misses.
struct Reading {
  std::uint64_t notices = 0, chunks = 0;
  std::uint64_t began = 0;  ///< what was forgotten up to here it cannot have heard of
  std::map<ChunkKey, std::uint64_t> tiles;  ///< of the chunks that it wants finely
  std::optional<ReadingThen> then;          ///< nothing: it follows the map as it is now

  /// It has forgotten the tiles of other chunks.
  void keep_tiles_of(const std::set<ChunkKey>& wanted);
};

/// Thread-safe. Written by the feed, read by the server; a slow client costs nothing.
class Board {
 public:
  explicit Board(std::size_t past_bytes = PastSurfaces::kMostBytes) : past_(past_bytes) {}

  /// Called, by the thread that writes, after every change.
  void set_listener(std::function<void()> changed);

  void put_notice(const std::string& key, std::string json);
  /// Nothing is said about it any more.
  void forget_notice(const std::string& key);
  struct Surfaces {
    std::vector<std::pair<TileKey, Piece>> tiles;
    std::vector<std::pair<ChunkKey, Piece>> chunks;
  };
  /// `stamp_ns`: the data's time from which on the map looks like that.
  void put_surfaces(const Surfaces& surfaces, StampNs stamp_ns = 0);
  /// From here on the map is known whole, see PastSurfaces.
  void map_known_from(StampNs stamp_ns);
  std::optional<StampNs> map_known_since() const;

  /// From now on next() gives the map of that time, or of now (nothing). False, and the map of now:
  /// it is not known.
  bool show_at(Reading& reading, std::optional<StampNs> stamp_ns) const;
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
  void take_then(Reading& reading, const std::vector<ChunkKey>& wanted, std::size_t bytes,
                 std::size_t& taken, std::vector<Piece>& pieces) const;
  bool take_tiles(Reading& reading, const std::vector<ChunkKey>& wanted, std::size_t bytes,
                  std::size_t& taken, std::vector<Piece>& pieces) const;

  mutable std::mutex mutex_;
  std::function<void()> listener_;
  NewestLog<std::string, Notice> notices_;
  NewestLog<ChunkKey, Piece> chunks_;
  std::map<ChunkKey, NewestLog<TileKey, Piece>> tiles_;
  PastSurfaces past_;
  std::uint64_t bytes_ = 0;  // of the tiles
};

}  // namespace pocd::view
