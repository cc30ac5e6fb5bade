// What ROS 2 tools and fleet managers take as it is: markers, grids, clouds, obstacles.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "map_msgs.h"
#include "nav_msgs.h"
#include "pocd/input/class_map.hpp"
#include "pocd/map/mesh.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd_dds/bridge/occupancy_projection.hpp"
#include "pocd_dds/bridge/surface_points.hpp"
#include "rmf_obstacle_msgs.h"
#include "sensor_msgs.h"
#include "visualization_msgs.h"

namespace pocd::dds {

using ObjectsById = std::map<ObjectId, ObjectSnapshot>;

/// Remembers who was there, and names those who have gone several times, because a message that
/// says so may be lost or be replaced by the next one before it is read.
class Departures {
 public:
  static constexpr int kTimes = 5;
  /// Ids whose deletion is to be said now, ascending.
  std::vector<ObjectId> update(const ObjectsById& present);

 private:
  std::map<ObjectId, int> gone_;  // how often it is still to be said
  std::set<ObjectId> present_;
};

/// Boxes coloured by stationarity, red 0 to green 1, in the namespace "pocd"; DELETE for `gone`.
/// With `first`, everything that an earlier run left in that namespace goes before.
visualization_msgs::msg::MarkerArray marker_array(const ObjectsById& objects,
                                                  const std::vector<ObjectId>& gone, bool first,
                                                  StampNs stamp_ns, const std::string& frame_id);

/// Open-RMF expires an obstacle when its own stamp plus its lifetime lies behind the receiver's
/// clock: the stamp is that of sending, not that of the frame. What is gone is no longer sent and
/// lapses: a receiver that does not read the action of a deletion would take it for an obstacle.
struct ObstacleOptions {
  std::string source;  ///< with the id, names an obstacle among those of all publishers
  std::string level_name;
  double lifetime_s = 3.0;
};
rmf_obstacle_msgs::msg::Obstacles obstacles_message(const ObjectsById& objects,
                                                    const ClassMap& classes,
                                                    const ObstacleOptions& options, StampNs now_ns,
                                                    const std::string& frame_id);

nav_msgs::msg::OccupancyGrid grid_message(const CellRectangle& grid, double resolution_m,
                                          StampNs stamp_ns, const std::string& frame_id);
map_msgs::msg::OccupancyGridUpdate grid_update_message(const CellRectangle& changed,
                                                       StampNs stamp_ns,
                                                       const std::string& frame_id);

/// x, y, z [m], rgb as RViz packs it, class (u16) and object (u32, 0 background); 24 bytes a point.
/// With more than `most_points`, every second, third, ... point.
sensor_msgs::msg::PointCloud2 cloud_message(const SurfacePoints& surface,
                                            const AppearanceOf& appearance, std::size_t most_points,
                                            StampNs stamp_ns, const std::string& frame_id);

}  // namespace pocd::dds
