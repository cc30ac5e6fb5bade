#include "pocd_dds/bridge/surface_points.hpp"

#include <memory>
#include <set>

namespace pocd::dds {
namespace {

constexpr int kStep[3] = {1, kTileSide, kTileSide* kTileSide};

TileKey neighbour(TileKey key, int axis, int by) {
  (axis == 0 ? key.x : axis == 1 ? key.y : key.z) += by;
  return key;
}

struct ByX {
  bool operator()(const TileKey& a, const TileKey& b) const {
    return a.x != b.x ? a.x < b.x : a < b;
  }
};

/// Tiles decoded once each, however many neighbours ask for them. Decoded ones are large: they are
/// held no longer than for two neighbouring values of x.
class Decoder {
 public:
  Decoder(const std::map<TileKey, MapTile>& tiles, double truncation_m)
      : tiles_(tiles), truncation_m_(truncation_m) {}

  /// Null where there is no tile.
  const DecodedTile* operator()(const TileKey& key) {
    const auto [entry, is_new] = decoded_.try_emplace(key);
    const auto tile = tiles_.find(key);
    if (is_new && tile != tiles_.end()) {
      entry->second =
          std::make_unique<DecodedTile>(decode_tile(tile->second.payload, truncation_m_));
    }
    return entry->second.get();
  }

  /// Nobody will ask for tiles of a smaller x any more.
  void forget_before(std::int32_t x) {
    while (!decoded_.empty() && decoded_.begin()->first.x < x) decoded_.erase(decoded_.begin());
  }

 private:
  const std::map<TileKey, MapTile>& tiles_;
  const double truncation_m_;
  std::map<TileKey, std::unique_ptr<DecodedTile>, ByX> decoded_;
};

std::vector<SurfacePoint> points_of(const TileKey& key, Decoder& decoded, double voxel_m) {
  std::vector<SurfacePoint> points;
  const DecodedTile* tile = decoded(key);
  if (tile == nullptr) return points;
  const DecodedTile* next[3];
  for (int axis = 0; axis < 3; ++axis) next[axis] = decoded(neighbour(key, axis, 1));
  for (int voxel = 0; voxel < kTileSide * kTileSide * kTileSide; ++voxel) {
    if (!tile->observed[voxel]) continue;
    const int at[3] = {voxel % kTileSide, voxel / kTileSide % kTileSide,
                       voxel / (kTileSide * kTileSide)};
    const float here = tile->distance_m[voxel];
    for (int axis = 0; axis < 3; ++axis) {
      const bool inside = at[axis] + 1 < kTileSide;
      const DecodedTile* other_tile = inside ? tile : next[axis];
      const int other = voxel + (inside ? 1 : 1 - kTileSide) * kStep[axis];
      if (other_tile == nullptr || !other_tile->observed[other]) continue;
      const float there = other_tile->distance_m[other];
      if ((here < 0.0f) == (there < 0.0f)) continue;
      const float share = here / (here - there);
      Eigen::Vector3d p(double{kTileSide} * key.x + at[0] + 0.5,
                        double{kTileSide} * key.y + at[1] + 0.5,
                        double{kTileSide} * key.z + at[2] + 0.5);
      p[axis] += static_cast<double>(share);
      points.push_back({(p * voxel_m).cast<float>(),
                        share <= 0.5f ? tile->owner[voxel] : other_tile->owner[other]});
    }
  }
  return points;
}

}  // namespace

void SurfacePoints::apply(const std::map<TileKey, MapTile>& tiles,
                          const std::vector<TileKey>& changed,
                          const std::vector<TileKey>& removed) {
  std::set<TileKey, ByX> affected;
  for (const auto* keys : {&changed, &removed}) {
    for (const TileKey& key : *keys) {
      affected.insert(key);
      for (int axis = 0; axis < 3; ++axis) affected.insert(neighbour(key, axis, -1));
    }
  }
  Decoder decoded(tiles, truncation_m_);
  for (const TileKey& key : affected) {
    decoded.forget_before(key.x);
    std::vector<SurfacePoint> points = points_of(key, decoded, voxel_size_m_);
    if (points.empty()) {
      points_.erase(key);
    } else {
      points.shrink_to_fit();
      points_[key] = std::move(points);
    }
  }
}

std::size_t SurfacePoints::size() const {
  std::size_t count = 0;
  for (const auto& [key, points] : points_) count += points.size();
  return count;
}

}  // namespace pocd::dds
