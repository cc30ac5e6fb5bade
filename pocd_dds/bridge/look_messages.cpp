#include "pocd_dds/bridge/look_messages.hpp"

namespace pocd::dds {

pocd_msgs::msg::MapLooks looks_message(const SectorKey& sector,
                                       const std::map<BlockKey, SectorLook>& regions,
                                       const MapRun& run) {
  pocd_msgs::msg::MapLooks message;
  message.map_id(run.map_id);
  message.x(sector.x);
  message.y(sector.y);
  message.z(sector.z);
  message.epoch(run.epoch);
  message.lineage(run.names());
  message.regions().reserve(regions.size());
  for (const auto& [region, look] : regions) {
    auto& entry = message.regions().emplace_back();
    entry.x(region.x);
    entry.y(region.y);
    entry.z(region.z);
    entry.last_looked(to_time(look.stamp_ns));
    entry.looked_in_run(look.in_run);
  }
  return message;
}

std::optional<std::map<BlockKey, SectorLook>> looks_from(const pocd_msgs::msg::MapLooks& message) {
  const SectorKey sector{message.x(), message.y(), message.z()};
  std::map<BlockKey, SectorLook> regions;
  for (const auto& entry : message.regions()) {
    const BlockKey region{entry.x(), entry.y(), entry.z()};
    if (!(sector_of(region) == sector)) return std::nullopt;
    const SectorLook look{to_stamp(entry.last_looked()), entry.looked_in_run()};
    if (!regions.emplace(region, look).second) return std::nullopt;
  }
  return regions;
}

}  // namespace pocd::dds
