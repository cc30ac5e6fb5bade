// The map and the objects as ROS 2 tools and fleet managers take them, without a bus.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "pocd/common/check.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/ros_messages.hpp"

namespace pocd::dds {
namespace {

constexpr double kVoxelM = 0.1;

/// A published map of columns that the test fills voxel by voxel.
class SmallMap {
 public:
  SmallMap() : map(config()), publisher(1, config()) {}

  static TsdfConfig config() {
    TsdfConfig config;
    config.voxel_size_m = kVoxelM;
    config.min_publish_weight = 1;
    return config;
  }
  void set(int x, int y, int z, double distance_m, std::uint32_t owner = 0) {
    const auto cut = [](int v) { return v >= 0 ? v / 8 : (v - 7) / 8; };
    VoxelBlock& block = map.touch({cut(x), cut(y), cut(z)});
    const int voxel = (x & 7) + 8 * ((y & 7) + 8 * (z & 7));
    block.weight[voxel] = 10;
    block.tsdf[voxel] =
        static_cast<std::int16_t>(std::lround(distance_m / config().truncation_m() * 32767));
    block.owner[voxel] = owner;
  }
  void publish_to(OccupancyProjection& projection) {
    const std::optional<MapDelta> delta = publisher.update(map);
    ASSERT_TRUE(delta);
    projection.apply(delta->changed, delta->removed);
  }

  TsdfMap map;
  MapPublisher publisher;
};

OccupancyOptions options() { return {kVoxelM, SmallMap::config().truncation_m(), 0.1, 2.0}; }

std::int8_t cell(const OccupancyProjection& projection, int x, int y) {
  const CellRectangle& grid = projection.grid();
  return grid
      .cells[static_cast<std::size_t>((y - grid.y) * static_cast<int>(grid.width) + (x - grid.x))];
}

TEST(OccupancyProjection, BandDecidesBetweenFreeOccupiedAndUnknown) {
  SmallMap map;
  map.set(1, 0, -1, 0.02);                           // floor only: free
  map.set(2, 0, -1, 0.02), map.set(2, 0, 5, 0.02);   // something on the floor
  map.set(3, 0, 5, 0.3);                             // free space only
  map.set(4, 0, 25, 0.02);                           // a lamp above the band
  map.set(5, 0, -9, 0.02);                           // the ground of a pit
  map.set(6, 0, -1, 0.02), map.set(6, 0, 25, 0.02);  // floor below a lamp
  OccupancyProjection projection(options());
  map.publish_to(projection);
  EXPECT_TRUE(projection.update());
  EXPECT_EQ(cell(projection, 0, 0), kCellUnknown);
  EXPECT_EQ(cell(projection, 1, 0), kCellFree);
  EXPECT_EQ(cell(projection, 2, 0), kCellOccupied);
  EXPECT_EQ(cell(projection, 3, 0), kCellFree);
  EXPECT_EQ(cell(projection, 4, 0), kCellUnknown);
  EXPECT_EQ(cell(projection, 5, 0), kCellUnknown);
  EXPECT_EQ(cell(projection, 6, 0), kCellFree);
}

TEST(OccupancyProjection, WhatNobodyHasLookedAtForLongHasAValueOfItsOwn) {
  SmallMap map;
  map.set(1, 0, -1, 0.02);                          // floor
  map.set(2, 0, -1, 0.02), map.set(2, 0, 5, 0.02);  // something on the floor
  const std::optional<MapDelta> all = map.publisher.update(map.map);
  ASSERT_TRUE(all);
  std::set<TileKey> old;
  for (const MapTile& tile : all->changed) old.insert(tile.key);
  const auto cells = [&](int value, const std::set<TileKey>& not_looked) {
    OccupancyOptions with_value = options();
    with_value.not_looked_at = value;
    OccupancyProjection projection(with_value);
    projection.apply(all->changed, {}, not_looked);
    projection.update();
    return std::vector<int>{cell(projection, 0, 0), cell(projection, 1, 0), cell(projection, 2, 0)};
  };
  EXPECT_EQ(cells(kCellUnknown, old), (std::vector<int>{-1, -1, -1}));
  EXPECT_EQ(cells(50, old), (std::vector<int>{-1, 50, 50})) << "what was unknown stays so";
  EXPECT_EQ(cells(OccupancyOptions::kAsItWas, old), (std::vector<int>{-1, 0, 100}));
  EXPECT_EQ(cells(50, {}), (std::vector<int>{-1, 0, 100}));
  // The floor's tile is looked at, the one above it is not: what stood there may stand there.
  EXPECT_EQ(cells(50, {TileKey{0, 0, 0}}), (std::vector<int>{-1, 0, 50}));
}

TEST(OccupancyProjection, UpdateIsTheSmallestRectangle) {
  SmallMap map;
  for (int x = -20; x < 20; ++x) map.set(x, 3, 5, 0.02);
  OccupancyProjection projection(options());
  map.publish_to(projection);
  EXPECT_TRUE(projection.update());
  EXPECT_FALSE(projection.changed_rectangle());
  EXPECT_EQ(projection.grid().x, -32);
  EXPECT_EQ(projection.grid().width, 64u);

  std::vector<std::int8_t> copy = projection.grid().cells;
  map.set(-18, 5, 5, 0.02);
  map.set(7, 9, 5, 0.3);
  map.set(2, 3, 5, 0.021);  // changes the tile, but no cell
  map.publish_to(projection);
  EXPECT_FALSE(projection.update()) << "the size is the same";
  ASSERT_TRUE(projection.changed_rectangle());
  const CellRectangle& changed = *projection.changed_rectangle();
  EXPECT_EQ(changed.x, -18 + 32);
  EXPECT_EQ(changed.y, 5);
  EXPECT_EQ(changed.width, 26u);
  EXPECT_EQ(changed.height, 5u);
  for (std::uint32_t i = 0; i < changed.cells.size(); ++i) {
    const std::size_t at =
        (changed.y + i / changed.width) * projection.grid().width + changed.x + i % changed.width;
    copy[at] = changed.cells[i];
  }
  EXPECT_EQ(copy, projection.grid().cells);
  EXPECT_FALSE(projection.update());
  EXPECT_FALSE(projection.changed_rectangle()) << "nothing has happened since";
}

TEST(OccupancyProjection, GrowsAndNeverShrinks) {
  SmallMap map;
  map.set(0, 0, 5, 0.02);
  OccupancyProjection projection(options());
  EXPECT_FALSE(projection.update()) << "no map, no grid";
  map.publish_to(projection);
  EXPECT_TRUE(projection.update());
  map.set(40, 0, 5, 0.02, 7);
  map.publish_to(projection);
  EXPECT_TRUE(projection.update());
  EXPECT_EQ(projection.grid().width, 48u);
  EXPECT_EQ(cell(projection, 40, 0), kCellOccupied);
  map.map.clear_object(ObjectId{7});
  map.publish_to(projection);
  EXPECT_FALSE(projection.update());
  EXPECT_EQ(cell(projection, 40, 0), kCellUnknown);
  EXPECT_EQ(projection.grid().width, 48u);
}

TEST(OccupancyProjection, FarTileDoesNotEatAllMemory) {
  SmallMap map;
  map.set(0, 0, 5, 0.02);
  map.set(10'000'000, 10'000'000, 5, 0.02, 7);
  OccupancyProjection projection(options());
  map.publish_to(projection);
  EXPECT_TRUE(projection.update());
  EXPECT_TRUE(projection.too_large());
  EXPECT_TRUE(projection.grid().cells.empty());
  map.map.clear_object(ObjectId{7});
  map.publish_to(projection);
  EXPECT_TRUE(projection.update()) << "what made it too large has gone";
  EXPECT_FALSE(projection.too_large());
  EXPECT_EQ(cell(projection, 0, 0), kCellOccupied);
}

TEST(OccupancyProjection, AFixedExtentHasItsSizeFromTheStart) {
  OccupancyOptions fixed = options();
  fixed.extent = cells_around(-1.25, -0.5, 2.0, 1.0, kVoxelM);
  EXPECT_EQ(fixed.extent.x, -13) << "outwards";
  EXPECT_EQ(fixed.extent.y, -5) << "what lies on an edge needs no further cell";
  EXPECT_EQ(fixed.extent.width, 33u);
  EXPECT_EQ(fixed.extent.height, 15u);
  OccupancyProjection projection(fixed);
  EXPECT_TRUE(projection.update()) << "before there is a map";
  EXPECT_EQ(projection.grid().cells, std::vector<std::int8_t>(33 * 15, kCellUnknown));
  EXPECT_FALSE(projection.update());

  SmallMap map;
  map.set(-13, -5, 5, 0.02), map.set(19, 9, 5, 0.02);  // its corners
  map.publish_to(projection);
  EXPECT_FALSE(projection.update());
  EXPECT_FALSE(projection.cut());
  ASSERT_TRUE(projection.changed_rectangle());
  EXPECT_EQ(projection.changed_rectangle()->width, 33u);
  EXPECT_EQ(projection.changed_rectangle()->height, 15u);
  EXPECT_EQ(cell(projection, -13, -5), kCellOccupied);
  EXPECT_EQ(cell(projection, 19, 9), kCellOccupied);

  map.set(-14, 0, 5, 0.02), map.set(10'000'000, 0, 5, 0.02);
  map.publish_to(projection);
  EXPECT_FALSE(projection.update()) << "it does not grow";
  EXPECT_TRUE(projection.cut());
  EXPECT_FALSE(projection.too_large());
  EXPECT_FALSE(projection.changed_rectangle());
  EXPECT_EQ(projection.grid().width, 33u);
  EXPECT_THROW(cells_around(-1e4, -1e4, 1e4, 1e4, kVoxelM), InputError);
}

// Nav2's static layer warns of anything else, and counts cells with the resolution as it is sent.
TEST(GridMessage, OriginIsAMultipleOfTheResolutionAsItIsSent) {
  CellRectangle grid{-123'457, 98'765, 1, 1, {0}};
  for (const double resolution_m : {0.05, 0.1, 0.02, 0.03}) {
    const auto message = grid_message(grid, resolution_m, 0, "map");
    const double sent_m = message.info().resolution();
    EXPECT_EQ(message.info().origin().position().x() / sent_m, grid.x) << resolution_m;
    EXPECT_EQ(message.info().origin().position().y() / sent_m, grid.y) << resolution_m;
  }
}

/// All points of a map that is taken over tile by tile, in steps, and at once.
TEST(SurfacePoints, LieOnASlantedPlaneAcrossTilesHoweverTheyCame) {
  // Plane z = 0.25 x + 0.33: the signed distance of a voxel centre is exact, so the points are.
  const auto height = [](double x) { return 0.25 * x + 0.33; };
  const double slope = std::sqrt(1.0 + 0.25 * 0.25);
  SmallMap map;
  SurfacePoints stepwise(kVoxelM, SmallMap::config().truncation_m());
  std::map<TileKey, MapTile> tiles;
  for (const int from : {-20, 0, 10}) {
    for (int x = from; x < from + (from == -20 ? 20 : 10); ++x) {
      for (int y = 0; y < 20; ++y) {
        const double x_m = (x + 0.5) * kVoxelM;
        for (int z = -20; z < 20; ++z) {
          const double distance = ((z + 0.5) * kVoxelM - height(x_m)) / slope;
          if (std::abs(distance) < 0.35) map.set(x, y, z, distance, x < 0 ? 5 : 0);
        }
      }
    }
    const std::optional<MapDelta> delta = map.publisher.update(map.map);
    ASSERT_TRUE(delta);
    std::vector<TileKey> changed;
    for (const MapTile& tile : delta->changed) {
      tiles[tile.key] = tile;
      changed.push_back(tile.key);
    }
    stepwise.apply(tiles, changed, delta->removed);
  }
  SurfacePoints at_once(kVoxelM, SmallMap::config().truncation_m());
  std::vector<TileKey> all;
  for (const auto& [key, tile] : tiles) all.push_back(key);
  at_once.apply(tiles, all, {});
  ASSERT_EQ(stepwise.size(), at_once.size());
  // 40 x 20 columns with one crossing each along z, and those along x.
  EXPECT_GE(stepwise.size(), 800u);
  for (const auto& [key, points] : at_once.by_tile()) {
    const auto& others = stepwise.by_tile().at(key);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f& p = points[i].position_W;
      EXPECT_NEAR(p.z(), height(p.x()), 0.01);
      EXPECT_EQ(others[i].position_W, p);
      EXPECT_EQ(others[i].owner, points[i].owner);
      if (std::abs(p.x()) > 0.1) {
        EXPECT_EQ(points[i].owner, p.x() < 0 ? 5u : 0u);
      }
    }
  }
  stepwise.apply({}, {}, all);
  EXPECT_EQ(stepwise.size(), 0u);
}

TEST(CloudMessage, HasTheDeclaredLayoutAndThins) {
  SmallMap map;
  for (int x = 0; x < 10; ++x) map.set(x, 0, 0, 0.05, 3), map.set(x, 0, 1, -0.05, 3);
  const std::optional<MapDelta> delta = map.publisher.update(map.map);
  SurfacePoints surface(kVoxelM, SmallMap::config().truncation_m());
  surface.apply(map.publisher.tiles(), {delta->changed.at(0).key}, {});
  ASSERT_EQ(surface.size(), 10u);
  const auto look = [](std::uint32_t owner) {
    return OwnerAppearance{{1, 2, 3}, ClassId(owner + 4)};
  };
  const auto cloud = cloud_message(surface, look, 100, 1'500'000'000, "map");
  EXPECT_EQ(cloud.width() * cloud.point_step(), cloud.data().size());
  EXPECT_EQ(cloud.row_step(), cloud.data().size());
  EXPECT_EQ(cloud.width(), 10u);
  const auto at = [&](const char* name, auto value) {
    for (const auto& field : cloud.fields()) {
      if (field.name() == name)
        std::memcpy(&value, &cloud.data()[9 * 24 + field.offset()], sizeof value);
    }
    return value;
  };
  EXPECT_FLOAT_EQ(at("x", 0.0f), 0.95f);
  EXPECT_FLOAT_EQ(at("y", 0.0f), 0.05f);
  EXPECT_NEAR(at("z", 0.0f), 0.1f, 0.002f);
  EXPECT_EQ(at("rgb", 0u), 0x010203u);
  EXPECT_EQ(at("class", std::uint16_t{0}), 7);
  EXPECT_EQ(at("object", 0u), 3u);
  EXPECT_EQ(cloud_message(surface, look, 4, 0, "map").width(), 4u);
}

TEST(Departures, AreSaidSeveralTimesAndOnlyOfThoseWhoWereThere) {
  Departures departures;
  const ObjectSnapshot any;
  EXPECT_TRUE(departures.update({{ObjectId{1}, any}, {ObjectId{2}, any}}).empty());
  for (int i = 0; i < Departures::kTimes; ++i) {
    EXPECT_EQ(departures.update({{ObjectId{2}, any}}), std::vector<ObjectId>{ObjectId{1}});
  }
  EXPECT_TRUE(departures.update({{ObjectId{2}, any}}).empty());
  EXPECT_EQ(departures.update({}), std::vector<ObjectId>{ObjectId{2}});
  EXPECT_TRUE(departures.update({{ObjectId{2}, any}}).empty()) << "it is back";
}

TEST(ObstaclesMessage, AddsWithLifetimeAndSource) {
  ObjectSnapshot object;
  object.id = ObjectId{4};
  object.class_id = 9;
  object.box.pose.position_W = {1, 2, 3};
  object.box.pose.yaw_rad = 0.5;
  object.box.size_m = {4, 5, 6};
  ClassMap classes;
  const auto message =
      obstacles_message({{object.id, object}}, classes, {"here", "L2", 2.25}, 7'000'000'001, "map");
  ASSERT_EQ(message.obstacles().size(), 1u);
  const auto& added = message.obstacles()[0];
  EXPECT_EQ(added.source(), "here");
  EXPECT_EQ(added.action(), 1);
  EXPECT_EQ(added.id(), 4);
  EXPECT_EQ(added.level_name(), "L2");
  EXPECT_EQ(added.classification(), "class_9");
  EXPECT_EQ(to_stamp(added.header().stamp()), 7'000'000'001);
  EXPECT_EQ(added.header().frame_id(), "map");
  EXPECT_EQ(added.lifetime().sec(), 2);
  EXPECT_EQ(added.lifetime().nanosec(), 250'000'000u);
  EXPECT_EQ(added.bbox().center().position().y(), 2.0);
  EXPECT_DOUBLE_EQ(added.bbox().center().orientation().z(), std::sin(0.25));
  EXPECT_EQ(added.bbox().size().z(), 6.0);
}

TEST(MarkerArray, ClearsWhatAnEarlierRunLeftAndDeletesWhoIsGone) {
  ObjectSnapshot object;
  object.id = ObjectId{4};
  const auto message = marker_array({{object.id, object}}, {ObjectId{2}}, true, 1, "map");
  ASSERT_EQ(message.markers().size(), 3u);
  EXPECT_EQ(message.markers()[0].action(), 3);
  EXPECT_EQ(message.markers()[1].action(), 2);
  EXPECT_EQ(message.markers()[1].id(), 2);
  EXPECT_EQ(message.markers()[2].action(), 0);
  EXPECT_EQ(message.markers()[2].id(), 4);
}

}  // namespace
}  // namespace pocd::dds
