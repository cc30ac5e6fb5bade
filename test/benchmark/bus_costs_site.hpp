// A large map with what the robots in it change, published by the component's own code.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "pocd/common/random.hpp"
#include "pocd_dds/node/map_publication.hpp"
#include "pocd_dds/node/object_publication.hpp"
#include "pocd_dds/node/ros_outputs.hpp"
#include "pocd_dds/node/status_publication.hpp"
#include "scale_halls.hpp"

namespace pocd::benchmark {

/// What one robot does that drives through a place that is known: from a run of the pipeline.
struct DriveLoad {
  double seconds = 0.0;
  /// Per step of the map, its blocks that changed, as they are after it.
  std::vector<std::vector<std::pair<BlockKey, VoxelBlock>>> steps;
  double tiles_per_step = 0.0, tile_bytes_per_s = 0.0;
  double states_per_s = 0.0, events_per_s = 0.0;
};
/// Drives through the first hall of the site at 1.2 m/s, 15 frames per second of data time.
DriveLoad drive_load(Site& site, double map_period_s, double object_period_s);

/// The component without its pipeline: publishes the site's map and objects, as Node does, by a
/// thread that writes what is new, one that sends, and one for the topics of ROS 2 tools.
class SitePublisher {
 public:
  SitePublisher(Site& site, const NodeFile& config, const dds::BusOptions& bus);

  /// Map and objects as they are, for those who come.
  void publish_all();
  /// Goes on until `done`: as many robots as given repeat the drive, each in a
  /// hall of its own.
  void serve(const std::function<bool()>& done, const DriveLoad& load, int robots);

  const dds::MapPublication& map() const { return map_; }
  std::size_t object_count() const { return snapshots_.size(); }

 private:
  using Clock = std::chrono::steady_clock;
  void work(const std::atomic<bool>& stopping, const DriveLoad& load, int robots);
  void tell(const std::atomic<bool>& stopping);
  void draw(const std::atomic<bool>& stopping);
  void write_objects(const DriveLoad& load, int robots, double seconds, StampNs stamp_ns);
  void change_map(const DriveLoad& load, int robots);
  void send_status(int robots);

  Site& site_;
  const NodeFile config_;
  std::shared_ptr<dds::Participant> participant_;
  dds::Wakeup wakeup_;
  dds::Wakeup tellers_wakeup_;
  dds::ObjectPublication objects_;
  dds::MapPublication map_;
  dds::StatusPublication status_;
  dds::RosOutputs outputs_;
  std::vector<ObjectSnapshot> snapshots_;
  Random random_{1};
  std::size_t step_ = 0;
  double states_due_ = 0.0, events_due_ = 0.0;
  std::uint64_t events_ = 0;
};

}  // namespace pocd::benchmark
