// Several nodes on one domain: each with a map of its own, and two that say they have the same one.
#include <gtest/gtest.h>

#include <atomic>

#include "map_source.hpp"
#include "nav_msgsPubSubTypes.h"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/map_mirror.hpp"

namespace pocd {
namespace {

MirrorOptions map_of(const TestDomain& domain, int map_id, CatchUp means = CatchUp::kEither) {
  MirrorOptions options;
  options.domain = domain.number();
  options.map_id = static_cast<std::uint32_t>(map_id);
  options.catch_up = means;
  return options;
}

/// What a node says of its map and its objects, in the process of the test.
struct Publisher {
  Publisher(const TestDomain& domain, int map, std::uint64_t epoch)
      : map_id(map),
        source(domain, epoch, 40.0, "", map),
        objects(source.participant, dds::topics::kObjects),
        events(source.participant, dds::topics::kObjectEvents) {}

  void write_objects(int count) {
    const dds::MapRun run{static_cast<std::uint32_t>(map_id),
                          source.publication.publisher().epoch()};
    for (int i = 1; i <= count; ++i) {
      ObjectSnapshot object;
      object.id = static_cast<ObjectId>(i);
      auto state = dds::object_message(object, run, ClassMap{}, 1, "map");
      EXPECT_TRUE(objects.write(state));
      ObjectEvent event;
      event.object = object.id;
      auto message = dds::event_message(event, run, ClassMap{}, "map");
      EXPECT_TRUE(events.write(message));
    }
  }

  int map_id;
  MapSource source;
  dds::Writer<pocd_msgs::msg::ObjectStatePubSubType> objects;
  dds::Writer<pocd_msgs::msg::ObjectEventPubSubType> events;
};

// Tiles of both maps have the same keys, and different voxels.
TEST(TwoNodes, MapsWithIdsOfTheirOwnKeepApart) {
  const TestDomain domain;
  Publisher lower(domain, 3, 1), upper(domain, 4, 2);
  std::array<std::atomic<int>, 2> heard{};
  std::vector<std::unique_ptr<MapMirror>> mirrors;
  for (const int map_id : {3, 4}) {
    for (const CatchUp means : {CatchUp::kTiles, CatchUp::kSnapshot}) {
      MirrorOptions options = map_of(domain, map_id, means);
      if (means == CatchUp::kTiles) {
        options.on_event = [&heard, map_id](const ObjectEvent&, const std::string&) {
          ++heard[static_cast<std::size_t>(map_id - 3)];
        };
      }
      mirrors.push_back(std::make_unique<MapMirror>(options));
    }
  }
  std::atomic<bool> stopping{false};
  std::thread serving([&] {
    for (int turn = 0; !stopping; ++turn) {
      for (Publisher* node : {&lower, &upper}) {
        node->source.turn();
        if (turn < 40) node->source.step(6, false);
        if (turn % 10 == 0) node->source.publication.send_manifest(0, false);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  // Events are not kept for late joiners: every mirror has to be there, of either map.
  const auto matched = [&](const Publisher& node) {
    const int all = static_cast<int>(mirrors.size());
    return node.objects.matched() == all && node.events.matched() == all;
  };
  EXPECT_TRUE(eventually([&] { return matched(lower) && matched(upper); }));
  lower.write_objects(5);
  upper.write_objects(7);
  for (std::size_t i = 0; i < mirrors.size(); ++i) {
    const Publisher& node = i < 2 ? lower : upper;
    const std::size_t objects = i < 2 ? 5 : 7;
    EXPECT_TRUE(mirrors[i]->wait_until(
        [&](const MirrorStatus& status) {
          return status.in_step && status.version > 20 && status.objects == objects;
        },
        kGenerous))
        << i << ": " << mirrors[i]->status().stale_because << mirrors[i]->status().objects;
    const MirrorStatus status = mirrors[i]->status();
    EXPECT_EQ(status.epoch, node.source.publication.publisher().epoch());
    EXPECT_EQ(mirrors[i]->contents().objects.size(), objects);
    EXPECT_EQ(status.publishers, 1u);
  }
  EXPECT_TRUE(eventually([&] { return heard[0] >= 5 && heard[1] >= 7; }));
  stopping = true;
  serving.join();
  EXPECT_EQ(heard[0], 5);
  EXPECT_EQ(heard[1], 7);
}

TEST(TwoNodes, OneMapIdForTwoIsSaidByThemAndByTheMirror) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  dds::Wakeup wakeup;
  dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> upper_grid(
      bus, dds::topics::kOccupancy, "rt/upper/map", dds::topics::kOccupancy.delivery, wakeup);
  MapMirror mirror(map_of(domain, 0)), upper_mirror(map_of(domain, 4));
  Process first(node_command(domain, {"--epoch", "1"}));
  const auto in_step = [](const MirrorStatus& status) { return status.in_step; };
  ASSERT_TRUE(mirror.wait_until(in_step, kGenerous));
  Process upper(node_command(
      domain, {"--epoch", "3", "--set", "node.map_id=4", "--set", "node.outputs.namespace=upper"}));
  ASSERT_TRUE(upper_mirror.wait_until(in_step, kGenerous));
  EXPECT_EQ(upper_mirror.status().epoch, 3u);
  EXPECT_TRUE(eventually([&] { return upper_grid.matched() == 1; }));
  EXPECT_TRUE(mirror.status().in_step) << "another map is no rival";

  Process second(node_command(domain, {"--epoch", "2"}));
  ASSERT_TRUE(mirror.wait_until([](const MirrorStatus& status) { return status.publishers == 2; },
                                kGenerous));
  EXPECT_FALSE(mirror.status().in_step);
  EXPECT_EQ(mirror.status().epoch, 1u) << "the one that was there first";
  EXPECT_EQ(mirror.status().stale_because,
            "map 0 is published by 2 nodes at once, epochs 0000000000000001 (followed) and "
            "0000000000000002: give each a node.map_id of its own");
  for (Process* node : {&first, &second}) {
    EXPECT_TRUE(eventually([&] {
      return node->err().find("publishes map 0 as well") != std::string::npos;
    })) << node->err();
  }
  EXPECT_TRUE(
      eventually([&] { return health.problem("pocd/map/manifest", "second_publisher") > 0; }));

  // The copy goes over to the other one when the first ends.
  first.signal(SIGINT);
  EXPECT_EQ(first.wait().exit_code, 0);
  EXPECT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.in_step && status.epoch == 2; }, kGenerous))
      << mirror.status().stale_because;
  for (Process* node : {&second, &upper}) node->signal(SIGINT);
  EXPECT_EQ(second.wait().exit_code, 0);
  const CommandResult quiet = upper.wait();
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.err.find("as well"), std::string::npos) << quiet.err;
}

}  // namespace
}  // namespace pocd
