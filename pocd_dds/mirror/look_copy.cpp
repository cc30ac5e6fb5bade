#include "mirror/look_copy.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace pocd::dds {

namespace msg = pocd_msgs::msg;

std::uint64_t LookCopy::take(Reader<msg::MapLooksPubSubType>& reader, int most) {
  std::uint64_t damaged = 0;
  reader.take_some(most, [&](const msg::MapLooks& message, const SampleMeta& meta) {
    // What a run that has gone said of a region is true as long as its lineage goes on.
    if (!meta.valid || message.map_id() != map_id_) return;
    std::optional<std::map<BlockKey, SectorLook>> regions = looks_from(message);
    if (!regions) {
      ++damaged;
      return;
    }
    sectors_[{message.x(), message.y(), message.z()}] = {message.epoch(), message.lineage(),
                                                         std::move(*regions)};
  });
  return damaged;
}

void LookCopy::add_to(MirrorContents& contents, const msg::MapManifest* manifest) const {
  if (manifest == nullptr) return;
  for (const auto& [key, sector] : sectors_) {
    if (sector.lineage != manifest->lineage()) continue;
    const bool of_this_run = sector.epoch == manifest->epoch();
    for (const auto& [region, look] : sector.regions) {
      contents.regions.push_back({region, look.stamp_ns, of_this_run && look.in_run});
    }
  }
  std::sort(contents.regions.begin(), contents.regions.end(),
            [](const MirrorRegion& a, const MirrorRegion& b) { return a.region < b.region; });
}

}  // namespace pocd::dds
