// When regions of the map were last looked at, as messages, and back.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "pocd/map/voxel_block.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_msgs.h"

namespace pocd::dds {

/// A sector is a cube of 8^3 regions: region key >> kSectorShift.
using SectorKey = BlockKey;
constexpr int kSectorShift = 3;

inline SectorKey sector_of(const BlockKey& region) {
  return {region.x >> kSectorShift, region.y >> kSectorShift, region.z >> kSectorShift};
}

struct SectorLook {
  StampNs stamp_ns = 0;
  bool in_run = false;  ///< false: before this run
};

/// `regions` are of the sector.
pocd_msgs::msg::MapLooks looks_message(const SectorKey& sector,
                                       const std::map<BlockKey, SectorLook>& regions,
                                       const MapRun& run);
/// Nothing for a message that names more regions than a sector has, one twice, or one outside it.
std::optional<std::map<BlockKey, SectorLook>> looks_from(const pocd_msgs::msg::MapLooks& message);

}  // namespace pocd::dds
