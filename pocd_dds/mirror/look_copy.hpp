// When regions of the map that is followed were last looked at.
#pragma once

#include <cstdint>
#include <map>

#include "pocd_dds/bridge/look_messages.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class LookCopy {
 public:
  explicit LookCopy(std::uint32_t map_id) : map_id_(map_id) {}

  /// Takes at most `most` messages; the number of those that cannot be true.
  std::uint64_t take(Reader<pocd_msgs::msg::MapLooksPubSubType>& reader, int most);
  /// What was said of the lineage that is followed; nothing without a manifest.
  void add_to(MirrorContents& contents, const pocd_msgs::msg::MapManifest* manifest) const;

 private:
  struct Sector {
    std::uint64_t epoch = 0, lineage = 0;
    std::map<BlockKey, SectorLook> regions;
  };
  const std::uint32_t map_id_;
  std::map<SectorKey, Sector> sectors_;
};

}  // namespace pocd::dds
