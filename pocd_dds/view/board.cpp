#include "view/board.hpp"

#include <algorithm>

namespace pocd::view {
namespace {

constexpr std::uint64_t kAnyRevision = ~std::uint64_t{0};

}  // namespace

void Reading::keep_tiles_of(const std::set<ChunkKey>& wanted) {
  const auto keep = [&](auto& chunks) {
    for (auto chunk = chunks.begin(); chunk != chunks.end();) {
      chunk = wanted.count(chunk->first) > 0 ? std::next(chunk) : chunks.erase(chunk);
    }
  };
  keep(tiles);
  if (!then) return;
  keep(then->tiles);
  for (auto chunk = then->done.begin(); chunk != then->done.end();) {
    chunk = wanted.count(*chunk) > 0 ? std::next(chunk) : then->done.erase(chunk);
  }
  then->complete = false;
}

void Board::set_listener(std::function<void()> changed) {
  const std::lock_guard<std::mutex> lock(mutex_);
  listener_ = std::move(changed);
}

void Board::changed() {
  std::function<void()> listener;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    listener = listener_;
  }
  if (listener) listener();
}

void Board::put_notice(const std::string& key, std::string json) {
  Piece piece = json_piece(json);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    notices_.put(key, {std::move(json), std::move(piece)});
  }
  changed();
}

void Board::forget_notice(const std::string& key) {
  const std::lock_guard<std::mutex> lock(mutex_);
  notices_.forget(key);
}

void Board::put_surfaces(const Surfaces& surfaces, StampNs stamp_ns) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [key, piece] : surfaces.tiles) {
      auto& log = tiles_[chunk_of(key)];
      const auto* before = log.find(key);
      if (before != nullptr) bytes_ -= before->value->size();
      bytes_ += piece->size();
      log.put(key, piece);
      past_.put_tile(key, log.newest(), piece, stamp_ns);
    }
    for (const auto& [key, piece] : surfaces.chunks) {
      chunks_.put(key, piece);
      past_.put_chunk(key, chunks_.newest(), piece, stamp_ns);
    }
  }
  changed();
}

void Board::map_known_from(StampNs stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  past_.known_from(stamp_ns);
}

std::optional<StampNs> Board::map_known_since() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return past_.known_since();
}

bool Board::show_at(Reading& reading, std::optional<StampNs> stamp_ns) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool known = !stamp_ns || (past_.known_since() && *stamp_ns >= *past_.known_since());
  if (!known) stamp_ns.reset();
  if (!reading.then && !stamp_ns) return known;
  if (!reading.then) {
    ReadingThen& then = reading.then.emplace();
    // Of what has changed after it has read, it may have any older one.
    const auto has = [](std::uint64_t revision, std::uint64_t read) {
      return revision <= read ? revision : kAnyRevision;
    };
    for (const auto& [key, versions] : past_.chunks()) {
      then.chunks[key] = has(versions.back().revision, reading.chunks);
    }
    for (const auto& [chunk, read] : reading.tiles) {
      const auto* tiles = past_.tiles(chunk);
      if (tiles == nullptr) continue;
      for (const auto& [key, versions] : *tiles) {
        then.tiles[chunk][key] = has(versions.back().revision, read);
      }
    }
  }
  reading.then->at = stamp_ns;
  reading.then->complete = false;
  return known;
}

void Board::take_then(Reading& reading, const std::vector<ChunkKey>& wanted, std::size_t bytes,
                      std::size_t& taken, std::vector<Piece>& pieces) const {
  ReadingThen& then = *reading.then;
  if (then.complete) return;
  const auto take = [&](PieceKind kind, const TileKey& key, const PastSurfaces::Versions& versions,
                        std::uint64_t& has) {
    const PastSurfaces::Version* version = PastSurfaces::at(versions, then.at);
    const std::uint64_t revision = version == nullptr ? 0 : version->revision;
    if (revision == has) return false;
    has = revision;
    pieces.push_back(version == nullptr ? mesh_piece(kind, key, 0, {}) : version->piece);
    taken += pieces.back()->size();
    return true;
  };
  for (const auto& [key, versions] : past_.chunks()) {
    take(PieceKind::kChunk, key, versions, then.chunks[key]);
    if (taken >= bytes) return;
  }
  for (const ChunkKey& chunk : wanted) {
    const auto* tiles = past_.tiles(chunk);
    if (tiles == nullptr) continue;
    bool taken_any = false;
    for (const auto& [key, versions] : *tiles) {
      taken_any |= take(PieceKind::kTile, key, versions, then.tiles[chunk][key]);
    }
    if (then.done.insert(chunk).second || taken_any) pieces.push_back(done_piece(chunk));
    if (taken >= bytes) return;
  }
  then.complete = true;
  if (then.at) return;
  // It has what is shown now, and follows it again.
  reading.chunks = chunks_.newest();
  reading.tiles.clear();
  for (const ChunkKey& chunk : wanted) {
    const auto log = tiles_.find(chunk);
    if (log != tiles_.end()) reading.tiles[chunk] = log->second.newest();
  }
  reading.then.reset();
}

std::vector<Piece> Board::next(Reading& reading, const std::vector<ChunkKey>& wanted,
                               std::size_t bytes, bool& reset) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  reset = reading.notices != 0 && reading.notices < notices_.pruned() &&
          reading.began < notices_.pruned();
  if (reset) {
    const bool then = reading.then.has_value();
    const std::optional<StampNs> at = then ? reading.then->at : std::nullopt;
    reading = {};
    if (then) reading.then.emplace().at = at;
  }
  if (reading.notices == 0) reading.began = notices_.pruned();
  std::vector<Piece> pieces;
  std::size_t taken = 0;
  while (taken < bytes) {
    const auto [key, entry] = notices_.after(reading.notices);
    if (entry == nullptr) break;
    reading.notices = entry->revision;
    taken += entry->value.piece->size();
    pieces.push_back(entry->value.piece);
  }
  // Who has read all that there is has missed nothing that was forgotten meanwhile.
  if (taken < bytes) reading.notices = std::max(reading.notices, notices_.newest());
  if (reading.then) {
    if (taken < bytes) take_then(reading, wanted, bytes, taken, pieces);
    return pieces;
  }
  while (taken < bytes) {
    const auto [key, entry] = chunks_.after(reading.chunks);
    if (entry == nullptr) break;
    reading.chunks = entry->revision;
    taken += entry->value->size();
    pieces.push_back(entry->value);
  }
  if (taken < bytes) take_tiles(reading, wanted, bytes, taken, pieces);
  return pieces;
}

bool Board::take_tiles(Reading& reading, const std::vector<ChunkKey>& wanted, std::size_t bytes,
                       std::size_t& taken, std::vector<Piece>& pieces) const {
  for (const ChunkKey& chunk : wanted) {
    const auto log = tiles_.find(chunk);
    if (log == tiles_.end()) continue;
    std::uint64_t& read = reading.tiles[chunk];
    if (read >= log->second.newest()) continue;
    while (taken < bytes) {
      const auto [key, entry] = log->second.after(read);
      if (entry == nullptr) break;
      read = entry->revision;
      taken += entry->value->size();
      pieces.push_back(entry->value);
    }
    if (taken >= bytes && read < log->second.newest()) return false;
    pieces.push_back(done_piece(chunk));
    if (taken >= bytes) return false;
  }
  return true;
}

std::vector<std::pair<std::string, std::string>> Board::notices_after(std::uint64_t& revision,
                                                                      const std::string& prefix,
                                                                      std::size_t most) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::pair<std::string, std::string>> found;
  while (found.size() < most) {
    const auto [key, entry] = notices_.after(revision);
    if (entry == nullptr) break;
    revision = entry->revision;
    if (key->compare(0, prefix.size(), prefix) == 0) found.emplace_back(*key, entry->value.json);
  }
  return found;
}

std::string Board::notice(const std::string& key) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto* entry = notices_.find(key);
  return entry == nullptr ? "" : entry->value.json;
}

std::size_t Board::tile_count() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t count = 0;
  for (const auto& [chunk, log] : tiles_) count += log.size();
  return count;
}

std::uint64_t Board::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_;
}

}  // namespace pocd::view
