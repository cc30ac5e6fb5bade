// The topics for ROS 2 tools and fleet managers, of a real component that lives in the time of a
// replay.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "bus_harness.hpp"
#include "map_msgsPubSubTypes.h"
#include "nav_msgsPubSubTypes.h"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/ros_messages.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "rmf_obstacle_msgsPubSubTypes.h"
#include "rosgraph_msgsPubSubTypes.h"
#include "sensor_msgsPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"

namespace pocd {
namespace {

/// Takes everything as it comes, like a tool.
class Tool {
 public:
  explicit Tool(const std::shared_ptr<dds::Participant>& bus)
      : grid_(bus, dds::topics::kOccupancy, wakeup_),
        updates_(bus, dds::topics::kOccupancyUpdates, wakeup_),
        surface_(bus, dds::topics::kSurface, wakeup_),
        markers_(bus, dds::topics::kMarkers, wakeup_),
        obstacles_(bus, dds::topics::kRmfObstacles, wakeup_),
        thread_([this] {
          while (!stopping_) {
            wakeup_.wait_for(std::chrono::milliseconds(20));
            take();
          }
        }) {}
  ~Tool() { stop(); }

  void stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wakeup_.wake();
    thread_.join();
    take();
  }
  /// How many of its topics have a writer.
  int matched() const {
    return (grid_.matched() > 0) + (updates_.matched() > 0) + (surface_.matched() > 0) +
           (markers_.matched() > 0) + (obstacles_.matched() > 0);
  }

  // To be looked at after stop().
  nav_msgs::msg::OccupancyGrid grid;
  sensor_msgs::msg::PointCloud2 surface;
  int grids = 0, updates = 0, clouds = 0;
  std::map<std::int32_t, visualization_msgs::msg::Marker> markers;
  std::set<std::int32_t> markers_deleted;
  std::map<std::int32_t, rmf_obstacle_msgs::msg::Obstacle> obstacles;
  std::set<std::int32_t> obstacles_deleted;
  std::vector<StampNs> obstacle_stamps;

 private:
  void take() {
    dds::SampleMeta meta;
    while (grid_.take(grid, meta)) ++grids;
    map_msgs::msg::OccupancyGridUpdate update;
    while (updates_.take(update, meta)) {
      ++updates;
      EXPECT_EQ(update.data().size(), std::size_t{update.width()} * update.height());
      EXPECT_EQ(update.header().frame_id(), "map");
    }
    while (surface_.take(surface, meta)) ++clouds;
    visualization_msgs::msg::MarkerArray array;
    while (markers_.take(array, meta)) {
      for (const auto& marker : array.markers()) {
        if (marker.action() == 3) markers.clear();
        if (marker.action() == 0) markers[marker.id()] = marker;
        if (marker.action() == 2 && markers.erase(marker.id()) > 0)
          markers_deleted.insert(marker.id());
      }
    }
    rmf_obstacle_msgs::msg::Obstacles list;
    while (obstacles_.take(list, meta)) {
      obstacle_stamps.push_back(dds::to_stamp(list.header().stamp()));
      for (const auto& obstacle : list.obstacles()) {
        if (obstacle.action() == 1) obstacles[obstacle.id()] = obstacle;
        if (obstacle.action() == 2 && obstacles.erase(obstacle.id()) > 0) {
          obstacles_deleted.insert(obstacle.id());
        }
      }
    }
  }

  dds::Wakeup wakeup_;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grid_;
  dds::Reader<map_msgs::msg::OccupancyGridUpdatePubSubType> updates_;
  dds::Reader<sensor_msgs::msg::PointCloud2PubSubType> surface_;
  dds::Reader<visualization_msgs::msg::MarkerArrayPubSubType> markers_;
  dds::Reader<rmf_obstacle_msgs::msg::ObstaclesPubSubType> obstacles_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

TEST(RosOutputs, ShowTheMapAndTheObjectsOfTheRun) {
  const TestDomain domain;
  Tool tool(test_participant(domain));
  MirrorOptions options;
  options.domain = domain.number();
  MapMirror mirror(options);
  Process node(node_command(
      domain,
      {"--lossless", "--set", "node.use_clock=true", "--set", "node.outputs.markers_hz=10", "--set",
       "node.outputs.occupancy_hz=10", "--set", "node.outputs.surface_hz=2", "--set",
       "node.outputs.obstacles_hz=10", "--set", "node.outputs.obstacle_lifetime_s=0.5"}));
  ASSERT_TRUE(eventually([&] { return tool.matched() == 5; }));
  const CommandResult played = run_command(play_command(domain, {"--clock"}));
  ASSERT_EQ(played.exit_code, 0) << played.err;
  node.signal(SIGINT);
  ASSERT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.in_step && status.final_version; },
      kGenerous));
  const CommandResult ended = node.wait();
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  tool.stop();
  const MirrorContents contents = mirror.contents();

  // The grid and the surface are those of the map that the mirror has proven to be the publisher's.
  std::vector<MapTile> tiles;
  std::vector<TileKey> keys;
  for (const auto& [key, tile] : contents.tiles) tiles.push_back(tile), keys.push_back(key);
  dds::OccupancyProjection projection({contents.voxel_size_m, contents.truncation_m, 0.1, 2.0});
  projection.apply(tiles, {});
  projection.update();
  EXPECT_GE(tool.grids, 2);
  EXPECT_GE(tool.updates, 1);
  ASSERT_GE(tool.grid.info().width(), projection.grid().width) << "a grid never shrinks";
  const std::set<std::int8_t> values(tool.grid.data().begin(), tool.grid.data().end());
  EXPECT_EQ(values, (std::set<std::int8_t>{-1, 0, 100}));
  const int dx = projection.grid().x -
                 static_cast<int>(
                     std::lround(tool.grid.info().origin().position().x() / contents.voxel_size_m));
  const int dy = projection.grid().y -
                 static_cast<int>(
                     std::lround(tool.grid.info().origin().position().y() / contents.voxel_size_m));
  std::size_t wrong = 0;
  for (std::uint32_t i = 0; i < projection.grid().cells.size(); ++i) {
    const std::uint32_t x = i % projection.grid().width + dx, y = i / projection.grid().width + dy;
    wrong += tool.grid.data()[y * tool.grid.info().width() + x] != projection.grid().cells[i];
  }
  EXPECT_EQ(wrong, 0u) << "of " << projection.grid().cells.size();

  dds::SurfacePoints points(contents.voxel_size_m, contents.truncation_m);
  points.apply(contents.tiles, keys, {});
  EXPECT_GE(tool.clouds, 2);
  EXPECT_EQ(tool.surface.width(), points.size());

  // One object was removed between the drives; the others are still there.
  EXPECT_EQ(tool.markers.size(), contents.objects.size());
  EXPECT_EQ(tool.markers_deleted.size(), 1u);
  EXPECT_EQ(tool.obstacles_deleted, tool.markers_deleted);
  for (const ObjectSnapshot& object : contents.objects) {
    const auto id = static_cast<std::int32_t>(to_index(object.id));
    EXPECT_EQ(tool.markers.count(id), 1u);
    ASSERT_EQ(tool.obstacles.count(id), 1u);
    EXPECT_EQ(tool.obstacles.at(id).classification(), "box");
  }
  // In the time of the replay, which is some twenty seconds long, and before the lifetime is over.
  ASSERT_GT(tool.obstacle_stamps.size(), 10u);
  for (std::size_t i = 0; i < tool.obstacle_stamps.size(); ++i) {
    EXPECT_LT(tool.obstacle_stamps[i], 1'000'000'000'000);
    if (i > 0) {
      EXPECT_LE(tool.obstacle_stamps[i - 1], tool.obstacle_stamps[i]);
    }
  }
}

TEST(RosOutputs, EachCanBeSwitchedOff) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  Tool tool(bus);
  std::vector<std::string> off;
  for (const char* name : {"markers", "occupancy", "surface", "obstacles", "diagnostics"}) {
    off.insert(off.end(), {"--set", std::string("node.outputs.") + name + "_hz=0"});
  }
  Process node(node_command(domain, off));
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr; }));
  const std::uint64_t heard = health.newest()->stamp().sec();
  // The second sample comes when all writers that there are have been announced for long.
  ASSERT_TRUE(
      eventually([&] { return health.newest()->stamp().sec() != static_cast<int>(heard); }));
  EXPECT_EQ(tool.matched(), 0);
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
  tool.stop();
  EXPECT_EQ(tool.grids + tool.clouds + tool.updates, 0);
  EXPECT_TRUE(tool.obstacle_stamps.empty());
}

}  // namespace
}  // namespace pocd
