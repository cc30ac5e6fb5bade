// Topics that ROS 2 tools and fleet managers take as they are: markers, occupancy grid, surface,
// obstacles.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "map_msgsPubSubTypes.h"
#include "nav_msgsPubSubTypes.h"
#include "pocd/config/node_config.hpp"
#include "pocd_dds/bridge/ros_messages.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/byte_budget.hpp"
#include "pocd_dds/node/node_clock.hpp"
#include "rmf_obstacle_msgsPubSubTypes.h"
#include "sensor_msgsPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"

namespace pocd::dds {

/// In two steps, so that the pipeline only waits for copies of what is new: collect() is called
/// while the others' state is locked, send() after that. Not thread-safe.
class RosOutputs {
 public:
  RosOutputs(const std::shared_ptr<Participant>& participant, const NodeFile& config,
             std::uint64_t epoch);

  /// What there is, and which of it is new, has changed or has gone since the set was last emptied.
  template <class Key, class Value>
  struct Changes {
    const std::map<Key, Value>& all;
    std::set<Key>& keys;
  };
  /// Copies what has changed and the outputs that are due need, and empties the sets that it has
  /// copied; with `last`, the final state for those that keep one. `not_looked`: regions of the map
  /// that are known from before the node started and were not looked at since.
  void collect(const Changes<ObjectId, ObjectSnapshot>& objects,
               const Changes<TileKey, MapTile>& tiles, StampNs stamp_ns, StampNs now_ns, bool last,
               const std::set<BlockKey>& not_looked = {});
  /// What fails is counted and tried again at its next period; nothing is thrown. A cloud or a grid
  /// is sent when those before it have left at `outputs.rate_mb_s`.
  void send();
  /// Of the topics that keep their last state.
  bool wait_acknowledged(std::chrono::steady_clock::time_point end);
  /// Thread-safe.
  std::uint64_t failures() const;
  /// The grid is not published: tiles are too far apart. Thread-safe.
  bool grid_too_large() const { return grid_too_large_; }
  /// Part of the map is outside of the grid's fixed extent. Thread-safe.
  bool grid_cut() const { return grid_cut_; }
  /// Messages that could not be made, by topic. Thread-safe.
  std::map<std::string, std::uint64_t> broken() const {
    const std::lock_guard<std::mutex> lock(broken_mutex_);
    return broken_;
  }

 private:
  void send_markers();
  void send_obstacles();
  void send_occupancy();
  void send_surface();
  /// Runs one of the above. False: what it has thrown is counted under the topic.
  bool attempt(const std::string& topic, void (RosOutputs::*send_one)());
  void spend(const RawWriter& writer, std::size_t bytes);
  void copy_tiles(const Changes<TileKey, MapTile>& tiles, const std::set<BlockKey>& not_looked);

  const NodeFile config_;
  const RosOutputConfig& rates_;
  const ObstacleOptions obstacle_options_;
  std::unique_ptr<Writer<visualization_msgs::msg::MarkerArrayPubSubType>> markers_;
  std::unique_ptr<Writer<nav_msgs::msg::OccupancyGridPubSubType>> grid_;
  std::unique_ptr<Writer<map_msgs::msg::OccupancyGridUpdatePubSubType>> grid_updates_;
  std::unique_ptr<Writer<sensor_msgs::msg::PointCloud2PubSubType>> surface_;
  std::unique_ptr<Writer<rmf_obstacle_msgs::msg::ObstaclesPubSubType>> obstacles_;
  // One of the two.
  std::unique_ptr<RenamedWriter<rmf_obstacle_msgs::msg::ObstaclesHumblePubSubType>>
      humble_obstacles_;
  ByteBudget budget_;  // of clouds and grids, which have no parts
  Pace markers_pace_, occupancy_pace_, surface_pace_, obstacles_pace_;

  // What collect() took for send().
  bool markers_due_ = false, occupancy_due_ = false, surface_due_ = false, obstacles_due_ = false;
  StampNs stamp_ns_ = 0, now_ns_ = 0;
  bool last_ = false;
  ObjectsById objects_;               // a copy of the published objects
  std::map<TileKey, MapTile> tiles_;  // a copy of the published map
  // Steps of that copy that the grid and the surface have not taken over yet; true: changed, else
  // removed.
  std::map<TileKey, bool> grid_steps_, surface_steps_;
  std::set<TileKey> old_tiles_;  // of the grid's steps: not looked at since the start

  bool all_markers_anew_ = true;
  Departures marker_departures_;
  OccupancyProjection projection_;
  std::atomic<bool> grid_too_large_{false}, grid_cut_{false};
  StampNs grid_whole_ns_ = 0;   // when the last whole grid was sent
  int grid_readers_ = 0;        // ever matched when the last whole grid was sent
  bool grid_outdated_ = false;  // updates have been sent since the last whole one
  bool grid_unsent_ = false;    // the last message was refused
  SurfacePoints points_;
  bool surface_unsent_ = false;

  mutable std::mutex broken_mutex_;
  std::map<std::string, std::uint64_t> broken_;
};

}  // namespace pocd::dds
