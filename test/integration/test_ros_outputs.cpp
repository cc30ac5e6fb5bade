// The topics for ROS 2 tools and fleet managers, of a real component that lives in the time of a
// replay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "diagnostic_msgsPubSubTypes.h"
#include "full_writers.hpp"
#include "map_msgsPubSubTypes.h"
#include "map_source.hpp"
#include "nav_msgsPubSubTypes.h"
#include "over_the_bus.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/ros_messages.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_dds/node/ros_outputs.hpp"
#include "rmf_obstacle_msgsPubSubTypes.h"
#include "robot_sender.hpp"
#include "rosgraph_msgsPubSubTypes.h"
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
  std::set<std::int32_t> obstacles_deleted;
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
        if (obstacle.action() == 1) obstacles[obstacle.id()] = obstacle;
        if (obstacle.action() == 2 && obstacles.erase(obstacle.id()) > 0) {
          obstacles_deleted.insert(obstacle.id());
        }
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

/// The outputs alone, in a time that the test makes.
struct OutputsInSimulatedTime {
  explicit OutputsInSimulatedTime(const dds::RosOutputConfig& rates,
                                  const std::string& profiles = "")
      : bus(std::make_shared<dds::Participant>(
            dds::BusOptions{domain.number(), profiles, "pocd_test"})),
        outputs(bus, config(rates), 1) {}

  void at(double second) {
    const auto now_ns = static_cast<StampNs>(second * 1e9) + 1'000'000'000'000;
    outputs.collect({objects, touched}, {tiles, changed_tiles}, now_ns, now_ns, false);
    outputs.send();
  }
  void put(int id) {
    objects[static_cast<ObjectId>(id)].id = static_cast<ObjectId>(id);
    touched.insert(static_cast<ObjectId>(id));
  }
  void remove(int id) {
    objects.erase(static_cast<ObjectId>(id));
    touched.insert(static_cast<ObjectId>(id));
  }
  static dds::NodeFile config(const dds::RosOutputConfig& rates) {
    dds::NodeFile file;
    file.node.outputs = rates;
    return file;
  }

  const TestDomain domain;
  std::shared_ptr<dds::Participant> bus;
  dds::RosOutputs outputs;
  dds::ObjectsById objects;
  std::set<ObjectId> touched;
  std::map<TileKey, MapTile> tiles;
  std::set<TileKey> changed_tiles;
};

// As Open-RMF's obstacle manager does it: an obstacle is there until it is deleted or its lifetime
// since the last message about it is over.
TEST(RosOutputs, ObstaclesAreRefreshedInTimeAndGoByDeleteAndByLapse) {
  dds::RosOutputConfig rates;
  rates.obstacles_hz = 2.0;
  rates.markers_hz = 5.0;
  rates.occupancy_hz = rates.surface_hz = 0.0;
  rates.obstacle_lifetime_s = 1.25;
  OutputsInSimulatedTime node(rates);
  dds::Wakeup wakeup;
  dds::Reader<rmf_obstacle_msgs::msg::ObstaclesPubSubType> reader(
      node.bus, dds::topics::kRmfObstacles, wakeup);
  dds::Reader<visualization_msgs::msg::MarkerArrayPubSubType> marker_reader(
      node.bus, dds::topics::kMarkers, wakeup);
  ASSERT_TRUE(eventually([&] { return reader.matched() > 0 && marker_reader.matched() > 0; }));
  std::map<int, StampNs> ends_ns;  // what the manager has
  int messages = 0, marker_messages = 0, deletes = 0;
  node.put(1), node.put(2);
  const auto stamp = [](double second) {
    return static_cast<StampNs>(second * 1e9) + 1'000'000'000'000;
  };
  for (int tick = 0; tick < 200; ++tick) {  // ten seconds
    const double second = 0.05 * tick;
    if (tick == 100) node.remove(2);
    node.at(second);
    rmf_obstacle_msgs::msg::Obstacles list;
    visualization_msgs::msg::MarkerArray array;
    dds::SampleMeta meta;
    while (marker_reader.take(array, meta)) ++marker_messages;
    while (reader.take(list, meta)) {
      ++messages;
      for (const auto& obstacle : list.obstacles()) {
        if (obstacle.action() == 2) {
          ++deletes;
          ends_ns.erase(obstacle.id());
          continue;
        }
        ends_ns[obstacle.id()] = dds::to_stamp(obstacle.header().stamp()) +
                                 obstacle.lifetime().sec() * 1'000'000'000 +
                                 obstacle.lifetime().nanosec();
      }
    }
    // None lapses while it is there, not even when a message is lost.
    ASSERT_EQ(ends_ns.size(), tick < 100 ? 2u : 1u) << second;
    for (const auto& [id, end_ns] : ends_ns) EXPECT_GT(end_ns, stamp(second + 0.5)) << id;
  }
  // Best effort, and yet exact: the reader shares the participant of the writer.
  EXPECT_EQ(messages, 20) << "twice a second";
  EXPECT_EQ(marker_messages, 50) << "five times a second";
  EXPECT_EQ(deletes, 5) << "a message may be lost";
  // The component has gone: the manager forgets all within the lifetime.
  for (const auto& [id, end_ns] : ends_ns) EXPECT_LE(end_ns, stamp(9.95 + 1.25)) << id;
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

// A profile lets the writers keep one sample until it is acknowledged, and a reader has room for
// one: what is written beyond that is refused. It is made good when there is room, although nothing
// changes any more.
TEST(RosOutputs, WhatIsRefusedIsSentAgain) {
  talk_over_the_bus();  // the short cut within a process loses what the reader has no room for
  const TemporaryFolder folder;
  const auto profiles = folder.path() / "profiles.xml";
  write_one_sample_profiles(profiles, {"rt/pocd/map", "rt/pocd/objects/markers"});
  dds::RosOutputConfig rates;
  rates.markers_hz = rates.occupancy_hz = 1.0;
  rates.obstacles_hz = rates.surface_hz = 0.0;
  OutputsInSimulatedTime node(rates, profiles.string());
  dds::Wakeup wakeup;
  const dds::Delivery one{true, true, 0, 1, 0, false, 0};
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grids(node.bus, dds::topics::kOccupancy,
                                                            "rt/pocd/map", one, wakeup);
  dds::Reader<visualization_msgs::msg::MarkerArrayPubSubType> arrays(
      node.bus, dds::topics::kMarkers, "rt/pocd/objects/markers", one, wakeup);
  ASSERT_TRUE(eventually([&] { return grids.matched() > 0 && arrays.matched() > 0; }));

  TsdfMap map{TsdfConfig{}};
  MapPublisher publisher(1, TsdfConfig{});
  Random random(3);
  double second = 0.0;
  const auto grow = [&] {
    for (int i = 0; i < 2; ++i) fill_block(map, {static_cast<int>(8 * second) + i, i, 1}, random);
    const std::optional<MapDelta> step = publisher.make_step(map);
    ASSERT_TRUE(step);
    publisher.take_over(*step);
    node.tiles = publisher.tiles();
    for (const MapTile& tile : step->changed) node.changed_tiles.insert(tile.key);
    node.at(second += 1.0);
  };
  node.put(1), node.put(2);
  ASSERT_TRUE(eventually([&] {  // the reader's, the writer's, and those that are refused
    grow();
    return node.outputs.failures() > 0;
  }));
  node.remove(2);
  for (int i = 0; i < 2 * dds::Departures::kTimes; ++i) grow();

  std::vector<MapTile> tiles;
  for (const auto& entry : publisher.tiles()) tiles.push_back(entry.second);
  const dds::NodeFile config = OutputsInSimulatedTime::config(rates);
  dds::OccupancyProjection projection(
      {config.pipeline.map.voxel_size_m, config.pipeline.map.truncation_m(),
       config.node.outputs.occupancy_low_m, config.node.outputs.occupancy_high_m});
  projection.apply(tiles, {});
  projection.update();
  const auto known = [](const auto& cells) {
    return cells.size() - std::count(cells.begin(), cells.end(), -1);
  };
  ASSERT_GT(known(projection.grid().cells), 0u);
  nav_msgs::msg::OccupancyGrid grid;
  visualization_msgs::msg::MarkerArray array;
  std::set<std::int32_t> markers;
  dds::SampleMeta meta;
  EXPECT_TRUE(eventually([&] {
    node.at(second += 1.0);
    grids.take(grid, meta);
    if (arrays.take(array, meta)) {
      for (const auto& marker : array.markers()) {
        if (marker.action() == 3) markers.clear();
        if (marker.action() == 2) markers.erase(marker.id());
        if (marker.action() == 0) markers.insert(marker.id());
      }
    }
    return known(grid.data()) == known(projection.grid().cells) &&
           markers == std::set<std::int32_t>{1};
  })) << known(grid.data())
      << " of " << known(projection.grid().cells) << " cells, " << markers.size() << " markers";
}

// A tile that cannot be decoded: the topics made of it say so, the others and the caller go on.
TEST(RosOutputs, WhatCannotBeMadeHarmsNobody) {
  dds::RosOutputConfig rates;
  rates.markers_hz = rates.occupancy_hz = rates.surface_hz = 1.0;
  rates.obstacles_hz = 0.0;
  OutputsInSimulatedTime node(rates);
  dds::Wakeup wakeup;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grids(node.bus, dds::topics::kOccupancy,
                                                            wakeup);
  dds::Reader<sensor_msgs::msg::PointCloud2PubSubType> clouds(node.bus, dds::topics::kSurface,
                                                              wakeup);
  dds::Reader<visualization_msgs::msg::MarkerArrayPubSubType> arrays(
      node.bus, dds::topics::kMarkers, wakeup);
  ASSERT_TRUE(eventually([&] {
    return grids.matched() > 0 && clouds.matched() > 0 && arrays.matched() > 0;
  }));
  const TileKey broken{0, 0, 0};
  node.tiles[broken] = MapTile{broken, 1, TilePayload::Bytes{1, 2, 3}};
  node.changed_tiles.insert(broken);
  node.put(1);
  EXPECT_NO_THROW(node.at(1.0));
  EXPECT_EQ(node.outputs.broken(),
            (std::map<std::string, std::uint64_t>{{"rt/pocd/map", 1}, {"rt/pocd/surface", 1}}));
  dds::SampleMeta meta;
  visualization_msgs::msg::MarkerArray array;
  EXPECT_TRUE(arrays.take(array, meta)) << "is made of objects";

  // What is good again is published again.
  TsdfMap map{TsdfConfig{}};
  Random random(3);
  fill_block(map, {0, 0, 1}, random);
  MapPublisher publisher(1, TsdfConfig{});
  publisher.take_over(*publisher.make_step(map));
  node.tiles = publisher.tiles();
  for (const auto& [key, tile] : node.tiles) node.changed_tiles.insert(key);
  node.changed_tiles.insert(broken);
  node.at(2.5);
  nav_msgs::msg::OccupancyGrid grid;
  sensor_msgs::msg::PointCloud2 cloud;
  EXPECT_TRUE(grids.take(grid, meta));
  EXPECT_TRUE(clouds.take(cloud, meta));
  EXPECT_EQ(node.outputs.broken().size(), 2u);
}

// A cloud has no parts, so its rate is kept by the time between clouds.
TEST(RosOutputs, LargeOnesLeaveAtTheirRate) {
  dds::RosOutputConfig rates;
  rates.surface_hz = 20.0;
  rates.occupancy_hz = rates.markers_hz = rates.obstacles_hz = 0.0;
  rates.rate_mb_s = 0.01;
  OutputsInSimulatedTime node(rates);
  dds::Wakeup wakeup;
  dds::Reader<sensor_msgs::msg::PointCloud2PubSubType> clouds(node.bus, dds::topics::kSurface,
                                                              wakeup);
  ASSERT_TRUE(eventually([&] { return clouds.matched() > 0; }));
  TsdfMap map{TsdfConfig{}};
  MapPublisher publisher(1, TsdfConfig{});
  Random random(3);
  std::size_t bytes = 0;
  int written = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int step = 0; step < 20; ++step) {
    for (int i = 0; i < 4; ++i) fill_block(map, {step, i, 1}, random);
    publisher.take_over(*publisher.make_step(map));
    node.tiles = publisher.tiles();
    for (const auto& [key, tile] : node.tiles) node.changed_tiles.insert(key);
    node.at(1.0 + step);
    sensor_msgs::msg::PointCloud2 cloud;
    dds::SampleMeta meta;
    while (clouds.take(cloud, meta)) bytes += cloud.data().size(), ++written;
  }
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_GT(bytes, 10'000u) << "more than a second's worth at once";
  // The last one may overdraw.
  EXPECT_LE(written, 1 + static_cast<int>(elapsed_s)) << bytes << " bytes in " << elapsed_s << " s";
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
