// Objects and events as messages, and back.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "pocd/input/class_map.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_msgs.h"

namespace pocd::dds {

/// The map that a message is about, and the run of the node that says it.
struct MapRun {
  std::uint32_t map_id = 0;
  std::uint64_t epoch = 0;
  std::uint64_t lineage = 0;  ///< of the node's memory; 0: without one, the epoch

  /// What names objects.
  std::uint64_t names() const { return lineage != 0 ? lineage : epoch; }
};

/// Eight bytes of lineage and eight of the id, most significant first: never the same in two
/// lineages.
std::array<std::uint8_t, 16> object_uuid(std::uint64_t lineage, ObjectId id);

pocd_msgs::msg::ObjectState object_message(const ObjectSnapshot& object, const MapRun& run,
                                           const ClassMap& classes, StampNs stamp_ns,
                                           const std::string& frame_id);
ObjectSnapshot object_from(const pocd_msgs::msg::ObjectState& message);
pocd_msgs::msg::ObjectEvent event_message(const ObjectEvent& event, const MapRun& run,
                                          const ClassMap& classes, const std::string& frame_id);
ObjectEvent event_from(const pocd_msgs::msg::ObjectEvent& message);

}  // namespace pocd::dds
