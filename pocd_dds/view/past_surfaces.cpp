#include "view/past_surfaces.hpp"

#include <algorithm>

namespace pocd::view {
namespace {

constexpr StampNs kGrain_ns = 300000000;  // a step of the map comes every 0.5 s
constexpr StampNs kGrains = 1000;         // of the known time: a pixel of the time line

}  // namespace

void PastSurfaces::known_from(StampNs stamp_ns) {
  if (!known_since_) known_since_ = stamp_ns;
}

void PastSurfaces::put_tile(const TileKey& key, std::uint64_t revision, Piece piece,
                            StampNs stamp_ns) {
  put(tiles_[chunk_of(key)][key], {stamp_ns, revision, std::move(piece)}, {false, key, 0});
}

void PastSurfaces::put_chunk(const ChunkKey& key, std::uint64_t revision, Piece piece,
                             StampNs stamp_ns) {
  put(chunks_[key], {stamp_ns, revision, std::move(piece)}, {true, key, 0});
}

void PastSurfaces::put(Versions& versions, Version version, Replaced name) {
  newest_ns_ = std::max(newest_ns_, version.stamp_ns);
  const StampNs known = known_since_ ? newest_ns_ - *known_since_ : 0;
  const StampNs grain = std::max(kGrain_ns, known / kGrains);
  if (!versions.empty() && version.stamp_ns - versions.back().stamp_ns < grain) {
    version.stamp_ns = versions.back().stamp_ns;
    versions.back() = std::move(version);
    return;
  }
  if (!versions.empty()) {
    name.revision = versions.back().revision;
    bytes_ += versions.back().piece->size();
    replaced_.push_back(name);
  }
  versions.push_back(std::move(version));
  while (bytes_ > most_bytes_ && !replaced_.empty()) forget_oldest();
}

void PastSurfaces::forget_oldest() {
  const Replaced name = replaced_.front();
  replaced_.pop_front();
  Versions& versions = name.chunk ? chunks_[name.key] : tiles_[chunk_of(name.key)][name.key];
  const auto found = std::find_if(versions.begin(), versions.end(), [&](const Version& version) {
    return version.revision == name.revision;
  });
  if (found == versions.end() || std::next(found) == versions.end()) return;
  bytes_ -= found->piece->size();
  // Before that the map would lack it.
  if (known_since_) known_since_ = std::max(*known_since_, std::next(found)->stamp_ns);
  versions.erase(versions.begin(), std::next(found));
}

const std::map<TileKey, PastSurfaces::Versions>* PastSurfaces::tiles(const ChunkKey& chunk) const {
  const auto found = tiles_.find(chunk);
  return found == tiles_.end() ? nullptr : &found->second;
}

const PastSurfaces::Version* PastSurfaces::at(const Versions& versions,
                                              std::optional<StampNs> stamp_ns) {
  if (versions.empty()) return nullptr;
  if (!stamp_ns) return &versions.back();
  const auto after = std::upper_bound(
      versions.begin(), versions.end(), *stamp_ns,
      [](StampNs stamp, const Version& version) { return stamp < version.stamp_ns; });
  return after == versions.begin() ? nullptr : &*std::prev(after);
}

}  // namespace pocd::view
