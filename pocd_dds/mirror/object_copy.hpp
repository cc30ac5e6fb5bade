// Objects of the map that is followed, as they were last heard of.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>

#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class ObjectCopy {
 public:
  explicit ObjectCopy(std::uint32_t map_id) : map_id_(map_id) {}

  /// Takes at most `most` states.
  void take(Reader<pocd_msgs::msg::ObjectStatePubSubType>& reader, int most);
  /// The publisher that is followed says what it is: objects of another lineage are forgotten, and
  /// those of the run before, of the same lineage, when the present one has told all it knows; so
  /// are those that have gone since begin_anew().
  void settle(const pocd_msgs::msg::MapManifest& manifest);
  /// What is known was heard on another reader, and the next one tells all that there is.
  void begin_anew();

  /// Of the publisher that is followed; without one (null), all.
  std::size_t count(const pocd_msgs::msg::MapManifest* manifest) const;
  void add_to(MirrorContents& contents, const pocd_msgs::msg::MapManifest* manifest) const;

 private:
  const std::uint32_t map_id_;
  std::map<std::array<std::uint8_t, 16>, pocd_msgs::msg::ObjectState> objects_;
  std::set<std::array<std::uint8_t, 16>> heard_before_;  // and not since begin_anew()
  std::uint64_t epoch_ = 0, lineage_ = 0;                // of the last manifest; 0: none yet
};

}  // namespace pocd::dds
