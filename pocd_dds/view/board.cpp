#include "view/board.hpp"

#include <algorithm>

namespace pocd::view {

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

void Board::put_surfaces(const Surfaces& surfaces) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [key, piece] : surfaces.tiles) {
      auto& log = tiles_[chunk_of(key)];
      const auto* before = log.find(key);
      if (before != nullptr) bytes_ -= before->value->size();
      bytes_ += piece->size();
      log.put(key, piece);
    }
    for (const auto& [key, piece] : surfaces.chunks) chunks_.put(key, piece);
  }
  changed();
}

std::vector<Piece> Board::next(Reading& reading, const std::vector<ChunkKey>& wanted,
                               std::size_t bytes, bool& reset) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  reset = reading.notices != 0 && reading.notices < notices_.pruned() &&
          reading.began < notices_.pruned();
  if (reset) reading = {};
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
