// The topics for ROS 2 tools and fleet managers by themselves, in a time that the test makes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "full_writers.hpp"
#include "map_msgsPubSubTypes.h"
#include "map_source.hpp"
#include "nav_msgsPubSubTypes.h"
#include "over_the_bus.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/node/ros_outputs.hpp"
#include "renamed_reader.hpp"
#include "rmf_obstacle_msgsPubSubTypes.h"
#include "sensor_msgsPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"
#include "whole_run.hpp"

namespace pocd {
namespace {

/// The outputs alone, in a time that the test makes.
struct OutputsInSimulatedTime {
  explicit OutputsInSimulatedTime(const RosOutputConfig& rates, const std::string& profiles = "")
      : bus(std::make_shared<dds::Participant>(
            dds::BusOptions{domain.number(), profiles, "pocd_test"})),
        outputs(bus, config(rates), 1) {}

  void at(double second) {
    const auto now_ns = static_cast<StampNs>(second * 1e9) + 1'000'000'000'000;
    outputs.collect({objects, touched}, {tiles, changed_tiles}, now_ns, now_ns, false);
    outputs.send();
  }
  void put(int id) {
    ObjectSnapshot& object = objects[static_cast<ObjectId>(id)];
    object.id = static_cast<ObjectId>(id);
    object.box.size_m = {1.0, 1.0, 1.0};
    touched.insert(static_cast<ObjectId>(id));
  }
  void remove(int id) {
    objects.erase(static_cast<ObjectId>(id));
    touched.insert(static_cast<ObjectId>(id));
  }
  static NodeFile config(const RosOutputConfig& rates) {
    NodeFile file;
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

// As Open-RMF's obstacle manager does it: an obstacle is there until its lifetime since the last
// message about it is over. A deletion would be a box at the origin for a receiver that does not
// read the action.
TEST(RosOutputsAlone, ObstaclesAreRefreshedInTimeAndGoByLapse) {
  RosOutputConfig rates;
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
  int messages = 0, marker_messages = 0;
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
        EXPECT_EQ(obstacle.action(), 1);
        EXPECT_GT(obstacle.bbox().size().x(), 0.0);
        ends_ns[obstacle.id()] = dds::to_stamp(obstacle.header().stamp()) +
                                 obstacle.lifetime().sec() * 1'000'000'000 +
                                 obstacle.lifetime().nanosec();
      }
    }
    for (auto it = ends_ns.begin(); it != ends_ns.end();) {
      it = it->second < stamp(second) ? ends_ns.erase(it) : std::next(it);
    }
    // None lapses while it is there, not even when a message is lost; then it does.
    if (tick < 100) {
      ASSERT_EQ(ends_ns.size(), 2u) << second;
    } else if (second > 5.0 + 1.25) {
      ASSERT_EQ(ends_ns.size(), 1u) << second;
    }
    for (const auto& [id, end_ns] : ends_ns) {
      if (tick < 100 || id == 1) {
        EXPECT_GT(end_ns, stamp(second + 0.5)) << id;
      }
    }
  }
  // Best effort, and yet exact: the reader shares the participant of the writer.
  EXPECT_EQ(messages, 20) << "twice a second";
  EXPECT_EQ(marker_messages, 50) << "five times a second";
  // The component has gone: the manager forgets all within the lifetime.
  for (const auto& [id, end_ns] : ends_ns) EXPECT_LE(end_ns, stamp(9.95 + 1.25)) << id;
}

// Both have one name on the bus: a reader of either release is matched by whatever is sent, and
// reads what the setting says.
TEST(RosOutputsAlone, ObstaclesHaveTheFormOfTheRelease) {
  RosOutputConfig rates;
  rates.markers_hz = rates.occupancy_hz = rates.surface_hz = 0.0;
  rates.ros_release = RosRelease::kHumble;
  OutputsInSimulatedTime humble(rates);
  rates.ros_release = RosRelease::kIron;
  OutputsInSimulatedTime iron(rates);
  dds::Wakeup wakeup;
  // One participant has one form of a type.
  RenamedReader<rmf_obstacle_msgs::msg::ObstaclesHumblePubSubType> humble_reader(
      test_participant(humble.domain), dds::topics::kRmfObstacles, wakeup);
  dds::Reader<rmf_obstacle_msgs::msg::ObstaclesPubSubType> iron_reader(
      test_participant(iron.domain), dds::topics::kRmfObstacles, wakeup);
  rmf_obstacle_msgs::msg::ObstaclesHumble humble_list;
  rmf_obstacle_msgs::msg::Obstacles iron_list;
  dds::SampleMeta meta;
  humble.put(7), iron.put(7);
  double second = 0.0;
  ASSERT_TRUE(eventually([&] {  // best effort: until the first one arrives
    humble.at(second += 1.0), iron.at(second);
    const bool humble_heard =
        !humble_list.obstacles().empty() || humble_reader.take(humble_list, meta);
    const bool iron_heard = !iron_list.obstacles().empty() || iron_reader.take(iron_list, meta);
    return humble_heard && iron_heard;
  }));
  EXPECT_EQ(humble_reader.take_damaged() + iron_reader.take_damaged(), 0u);
  EXPECT_EQ(iron_list.header().frame_id(), "map");
  for (const auto* list : {&humble_list.obstacles(), &iron_list.obstacles()}) {
    ASSERT_EQ(list->size(), 1u);
    EXPECT_EQ(list->front().id(), 7);
    EXPECT_EQ(list->front().header().frame_id(), "map");
    EXPECT_EQ(list->front().bbox().size().x(), 1.0);
  }
}

// Nav2's static layer loses an update that comes between a new grid and its own next cycle.
TEST(RosOutputsAlone, TheWholeGridComesAgainAfterUpdates) {
  RosOutputConfig rates;
  rates.markers_hz = rates.obstacles_hz = rates.surface_hz = 0.0;
  rates.occupancy_hz = 1.0;
  rates.occupancy_whole_s = 5.0;
  OutputsInSimulatedTime node(rates);
  dds::Wakeup wakeup;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grids(node.bus, dds::topics::kOccupancy,
                                                            wakeup);
  dds::Reader<map_msgs::msg::OccupancyGridUpdatePubSubType> updates(
      node.bus, dds::topics::kOccupancyUpdates, wakeup);
  ASSERT_TRUE(eventually([&] { return grids.matched() > 0 && updates.matched() > 0; }));
  TsdfMap map{TsdfConfig{}};
  MapPublisher publisher(1, TsdfConfig{});
  Random random(3);
  std::vector<int> whole, parts;  // seconds at which they came
  for (int second = 1; second <= 20; ++second) {
    if (second <= 8) {  // then it stands still
      fill_block(map, {0, 0, 1}, random);
      const std::optional<MapDelta> step = publisher.make_step(map);
      ASSERT_TRUE(step);
      publisher.take_over(*step);
      node.tiles = publisher.tiles();
      for (const MapTile& tile : step->changed) node.changed_tiles.insert(tile.key);
    }
    node.at(second);
    dds::SampleMeta meta;
    nav_msgs::msg::OccupancyGrid grid;
    map_msgs::msg::OccupancyGridUpdate update;
    // Within a participant, what was written has arrived.
    while (grids.take(grid, meta)) whole.push_back(second);
    while (updates.take(update, meta)) parts.push_back(second);
  }
  EXPECT_EQ(whole, (std::vector<int>{1, 6, 11}));
  EXPECT_EQ(parts, (std::vector<int>{2, 3, 4, 5, 7, 8}));
}

// Nav2's static layer takes a map of another size as a new one, and resizes the costmap.
TEST(RosOutputsAlone, AFixedExtentIsSentBeforeThereIsAMap) {
  RosOutputConfig rates;
  rates.markers_hz = rates.obstacles_hz = rates.surface_hz = 0.0;
  rates.occupancy_extent = {-10.0, -5.0, 10.0, 5.0};
  OutputsInSimulatedTime node(rates);
  dds::Wakeup wakeup;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grids(node.bus, dds::topics::kOccupancy,
                                                            wakeup);
  nav_msgs::msg::OccupancyGrid grid;
  dds::SampleMeta meta;
  node.at(1.0);
  ASSERT_TRUE(eventually([&] { return grids.take(grid, meta); }));
  const double cell_m = OutputsInSimulatedTime::config(rates).pipeline.map.voxel_size_m;
  EXPECT_EQ(grid.info().width(), std::lround(20.0 / cell_m));
  EXPECT_EQ(grid.info().height(), std::lround(10.0 / cell_m));
  EXPECT_NEAR(grid.info().origin().position().x(), -10.0, 1e-5);
  EXPECT_FALSE(node.outputs.grid_cut());

  TsdfMap map{TsdfConfig{}};
  Random random(3);
  fill_block(map, {1000, 0, 1}, random);
  MapPublisher publisher(1, TsdfConfig{});
  publisher.take_over(*publisher.make_step(map));
  node.tiles = publisher.tiles();
  for (const auto& [key, tile] : node.tiles) node.changed_tiles.insert(key);
  node.at(3.0);
  EXPECT_TRUE(node.outputs.grid_cut());
}

// A profile lets the writers keep one sample until it is acknowledged, and a reader has room for
// one: what is written beyond that is refused. It is made good when there is room, although nothing
// changes any more.
TEST(RosOutputsAlone, WhatIsRefusedIsSentAgain) {
  talk_over_the_bus();  // the short cut within a process loses what the reader has no room for
  const TemporaryFolder folder;
  const auto profiles = folder.path() / "profiles.xml";
  write_one_sample_profiles(profiles, {"rt/pocd/map", "rt/pocd/objects/markers"});
  RosOutputConfig rates;
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
  const NodeFile config = OutputsInSimulatedTime::config(rates);
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
TEST(RosOutputsAlone, WhatCannotBeMadeHarmsNobody) {
  RosOutputConfig rates;
  rates.markers_hz = rates.occupancy_hz = rates.surface_hz = 1.0;
  rates.obstacles_hz = 0.0;
  OutputsInSimulatedTime node(rates);
  dds::Wakeup wakeup;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grids(node.bus, dds::topics::kOccupancy,
                                                            wakeup);
  dds::Reader<sensor_msgs::msg::PointCloud2PubSubType> clouds(node.bus, dds::topics::kSurface,
                                                              wakeup);
  dds::Reader<visualization_msgs::msg::MarkerArrayPubSubType> arrays(node.bus,
                                                                     dds::topics::kMarkers, wakeup);
  ASSERT_TRUE(eventually(
      [&] { return grids.matched() > 0 && clouds.matched() > 0 && arrays.matched() > 0; }));
  const TileKey broken{0, 0, 0};
  node.tiles[broken] = MapTile{broken, 1, TilePayload::Bytes{1, 2, 3}};
  node.changed_tiles.insert(broken);
  node.put(1);
  EXPECT_NO_THROW(node.at(1.0));
  EXPECT_EQ(node.outputs.broken(),
            (std::map<std::string, std::uint64_t>{{"rt/pocd/map", 1}, {"rt/pocd/surface", 1}}));
  dds::SampleMeta meta;
  visualization_msgs::msg::MarkerArray array;
  EXPECT_TRUE(eventually([&] { return arrays.take(array, meta); })) << "is made of objects";

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
  EXPECT_TRUE(eventually([&] { return grids.take(grid, meta); }));
  EXPECT_TRUE(eventually([&] { return clouds.take(cloud, meta); }));
  EXPECT_EQ(node.outputs.broken().size(), 2u);
}

// A cloud has no parts, so its rate is kept by the time between clouds.
TEST(RosOutputsAlone, LargeOnesLeaveAtTheirRate) {
  RosOutputConfig rates;
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
  const auto take_all = [&] {
    sensor_msgs::msg::PointCloud2 cloud;
    dds::SampleMeta meta;
    while (clouds.take(cloud, meta)) bytes += cloud.data().size(), ++written;
  };
  const auto start = std::chrono::steady_clock::now();
  for (int step = 0; step < 20; ++step) {
    for (int i = 0; i < 4; ++i) fill_block(map, {step, i, 1}, random);
    publisher.take_over(*publisher.make_step(map));
    node.tiles = publisher.tiles();
    for (const auto& [key, tile] : node.tiles) node.changed_tiles.insert(key);
    node.at(1.0 + step);
    take_all();
  }
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_TRUE(eventually([&] {
    take_all();
    return bytes > 10'000u;
  })) << bytes
      << ": more than a second's worth at once";
  // The last one may overdraw.
  EXPECT_LE(written, 1 + static_cast<int>(elapsed_s)) << bytes << " bytes in " << elapsed_s << " s";
}

}  // namespace
}  // namespace pocd
