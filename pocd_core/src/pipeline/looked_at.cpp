#include "looked_at.hpp"

#include <cmath>

namespace pocd {

LookedAt::LookedAt(double voxel_size_m)
    : inverse_m_(static_cast<float>(
          1.0 / (voxel_size_m * (VoxelBlock::kSide << BlockKey::kRegionShift)))) {}

void LookedAt::note(const OrganizedCloud& cloud, StampNs stamp_ns) {
  if (!on_) return;
  BlockKey last;
  bool any = false;
  // A region spans many pixels, also at a distance.
  constexpr std::size_t kStep = 13;
  for (std::size_t i = 0; i < cloud.size(); i += kStep) {
    const PixelKind kind = cloud.kind[i];
    if (kind == PixelKind::kNone || kind == PixelKind::kDynamic || kind == PixelKind::kIgnore) {
      continue;
    }
    const auto axis = [&](float v) {
      return static_cast<std::int32_t>(std::floor(v * inverse_m_));
    };
    const BlockKey region{axis(cloud.x_W[i]), axis(cloud.y_W[i]), axis(cloud.z_W[i])};
    if (any && region == last) continue;  // as most neighbours are
    last = region;
    any = true;
    StampNs& looked_ns = last_ns_[region];
    if (looked_ns == stamp_ns) continue;
    looked_ns = stamp_ns;
    fresh_.insert(region);
    if (notes_changes_) changed_.insert(region);
  }
}

std::vector<RegionLook> LookedAt::take() {
  std::vector<RegionLook> looks;
  looks.reserve(fresh_.size());
  for (const BlockKey& region : fresh_) looks.push_back({region, last_ns_.at(region)});
  fresh_.clear();
  return looks;
}

std::vector<RegionLook> LookedAt::all() const {
  std::vector<RegionLook> looks;
  looks.reserve(last_ns_.size());
  for (const auto& [region, stamp_ns] : last_ns_) looks.push_back({region, stamp_ns});
  return looks;
}

std::set<BlockKey> LookedAt::take_changed() {
  std::set<BlockKey> keys = std::move(changed_);
  changed_.clear();
  if (!std::exchange(notes_changes_, true)) {
    for (const auto& entry : last_ns_) keys.insert(entry.first);
  }
  return keys;
}

}  // namespace pocd
