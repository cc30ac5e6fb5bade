// What RViz, Foxglove and Nav2 show: objects as markers, the map as a grid.
#pragma once

#include <map>
#include <memory>
#include <set>

#include "nav_msgsPubSubTypes.h"
#include "pocd/map/map_delta.hpp"
#include "pocd/pipeline/frame_result.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/node_config.hpp"
#include "visualization_msgsPubSubTypes.h"

namespace pocd::dds {

/// Not thread-safe.
class VisualPublication {
 public:
  VisualPublication(const std::shared_ptr<Participant>& participant, const NodeFile& config);

  /// Boxes coloured by stationarity: red 0, green 1.
  void send_markers(const std::map<ObjectId, ObjectSnapshot>& objects, StampNs stamp_ns);
  /// Seen from above, between the configured heights: 100 where a surface is, 0 where only free
  /// space was seen, -1 unknown. One cell per voxel.
  void send_occupancy(const std::map<TileKey, MapTile>& tiles, StampNs stamp_ns);

 private:
  struct Column {
    std::uint64_t version = 0;
    std::vector<std::int8_t> cells;  // kTileSide x kTileSide
  };
  const NodeFile config_;
  std::unique_ptr<Writer<visualization_msgs::msg::MarkerArrayPubSubType>> markers_;
  std::unique_ptr<Writer<nav_msgs::msg::OccupancyGridPubSubType>> grid_;
  std::set<ObjectId> shown_;
  std::map<TileKey, Column> projected_;
};

}  // namespace pocd::dds
