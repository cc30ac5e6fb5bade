// The topics for ROS 2 tools and fleet managers, of a real component that lives in the time of a
// replay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "diagnostic_msgsPubSubTypes.h"
#include "map_msgsPubSubTypes.h"
#include "nav_msgsPubSubTypes.h"
#include "over_the_bus.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/occupancy_projection.hpp"
#include "pocd_dds/bridge/surface_points.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "rmf_obstacle_msgsPubSubTypes.h"
#include "robot_sender.hpp"
#include "sensor_msgsPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"
#include "whole_run.hpp"

namespace pocd {
namespace {

/// Takes everything as it comes, like a tool.
class Tool {
 public:
  explicit Tool(const std::shared_ptr<dds::Participant>& bus)
      : grid_(bus, dds::topics::kOccupancy, taker_.wakeup()),
        updates_(bus, dds::topics::kOccupancyUpdates, taker_.wakeup()),
        surface_(bus, dds::topics::kSurface, taker_.wakeup()),
        markers_(bus, dds::topics::kMarkers, taker_.wakeup()),
        obstacles_(bus, dds::topics::kRmfObstacles, taker_.wakeup()),
        diagnostics_(bus, dds::topics::kDiagnostics, taker_.wakeup()) {
    taker_.start([this] { take(); });
  }
  ~Tool() { stop(); }  // before the readers go
  void stop() { taker_.stop(); }
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
  std::vector<StampNs> obstacle_stamps;
  std::map<std::string, double> most;  ///< of each number in the diagnostics

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
    diagnostic_msgs::msg::DiagnosticArray diagnostics;
    while (diagnostics_.take(diagnostics, meta)) {
      for (const auto& status : diagnostics.status()) {
        for (const auto& entry : status.values()) {
          double& value = most[entry.key()];
          value = std::max(value, std::atof(entry.value().c_str()));
        }
      }
    }
    rmf_obstacle_msgs::msg::Obstacles list;
    while (obstacles_.take(list, meta)) {
      obstacle_stamps.push_back(dds::to_stamp(list.header().stamp()));
      for (const auto& obstacle : list.obstacles()) {
        EXPECT_EQ(obstacle.action(), 1);
        obstacles[obstacle.id()] = obstacle;
      }
    }
  }

  Taker taker_;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grid_;
  dds::Reader<map_msgs::msg::OccupancyGridUpdatePubSubType> updates_;
  dds::Reader<sensor_msgs::msg::PointCloud2PubSubType> surface_;
  dds::Reader<visualization_msgs::msg::MarkerArrayPubSubType> markers_;
  dds::Reader<rmf_obstacle_msgs::msg::ObstaclesPubSubType> obstacles_;
  dds::Reader<diagnostic_msgs::msg::DiagnosticArrayPubSubType> diagnostics_;
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
  play_and_end(node, play_command(domain, {"--clock"}));
  ASSERT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.in_step && status.final_version; },
      kGenerous));
  tool.stop();
  const MirrorContents contents = mirror.contents();

  // What the map costs on the bus: all tiles in under a minute, each a few hundred bytes.
  double bytes = 0.0;
  for (const auto& [key, tile] : contents.tiles) bytes += static_cast<double>(tile.payload.size());
  EXPECT_GT(tool.most["map bytes per second"], bytes / 60);
  EXPECT_GE(tool.most["map bytes published"], bytes);
  std::set<std::pair<int, int>> columns;
  for (const auto& [key, tile] : contents.tiles) columns.insert({key.x, key.y});
  const double side_m = kTileSide * contents.voxel_size_m;
  const double per_m2 = bytes / (static_cast<double>(columns.size()) * side_m * side_m);
  EXPECT_GT(tool.most["map bytes per m2"], 0.5 * per_m2);
  EXPECT_LT(tool.most["map bytes per m2"], 2.0 * per_m2);

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

// What one robot sees is a kilometre away from what the other sees: 400 million cells.
TEST(RosOutputs, AGridThatIsTooLargeIsSaidAndNotPublished) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender near(bus, "near"), far(bus, "far");
  Process node(fleet_command(domain, {"--lossless", "--set", "node.segmentation=absent"}));
  ASSERT_TRUE(
      eventually([&] { return health.newest() != nullptr && near.matched() && far.matched(); }));
  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    stamp_ns += 50'000'000;
    near.send_frame(stamp_ns);
    PoseQuaternion pose;
    pose.position = {1000.0, 1000.0, 0.0};
    far.send_odometry({"map", far.camera_frame(), stamp_ns, pose});
    far.send_image(stamp_ns);
    return health.problem(dds::topics::kOccupancy.name, "grid_too_large") == 1;
  })) << node.err();
  node.signal(SIGTERM);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(count_of(ended.err, "rt/pocd/map: a grid of more than 64000000 cells"), 1u)
      << ended.err;
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
  // A participant announces its writers in the order of their making, and the node makes that of
  // its health after those: all that there are have been found.
  EXPECT_EQ(tool.matched(), 0);
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
  tool.stop();
  EXPECT_EQ(tool.grids + tool.clouds + tool.updates, 0);
  EXPECT_TRUE(tool.obstacle_stamps.empty());
}

}  // namespace
}  // namespace pocd
