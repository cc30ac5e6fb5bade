// The published map on a real bus: many late joiners, and what the flow control is for.
#include <gtest/gtest.h>

#include <array>
#include <atomic>

#include "map_source.hpp"
#include "pocd/map/map_replica.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/map_mirror.hpp"

namespace pocd {
namespace {

/// Publishes a changing map from a thread of its own.
class ChangingMap {
 public:
  ChangingMap(const TestDomain& domain, std::uint64_t epoch)
      : source(domain, epoch, 40.0), thread_([this] { run(); }) {}
  ~ChangingMap() {
    stopping_ = true;
    thread_.join();
  }
  std::uint64_t steps() const { return steps_; }
  MapSource source;

 private:
  void run() {
    while (!stopping_) {
      source.wakeup.wait_for(std::chrono::milliseconds(20));
      source.turn();
      source.step(6, false);
      if (steps_++ % 10 == 0) source.publication.send_manifest(0, false);
    }
  }
  std::atomic<std::uint64_t> steps_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

bool whole(const MirrorStatus& status) { return status.in_step && status.version > 0; }

// 200 subscribers in waves, each at a random moment of a map that never rests, by all means of
// catching up. Each gets to a copy that is proven to be the publisher's at that version.
TEST(MapBus, TwoHundredLateJoinersConverge) {
  constexpr int kWaves = 10, kPerWave = 20;
  const TestDomain domain;
  ChangingMap map(domain, 11);
  Random random(2024);
  std::uint64_t gathered_by_tiles = 0, asked_by_tiles = 0, gathered_by_snapshot = 0;
  for (int wave = 0; wave < kWaves; ++wave) {
    // A reply answers all who listen, so those who read tiles are in waves of their own.
    const CatchUp means =
        std::array{CatchUp::kEither, CatchUp::kTiles, CatchUp::kSnapshot}[wave % 3];
    std::vector<std::unique_ptr<MapMirror>> mirrors;
    for (int i = 0; i < kPerWave; ++i) {
      const std::uint64_t moment = map.steps() + random.below(3);
      ASSERT_TRUE(eventually([&] { return map.steps() >= moment; }));
      MirrorOptions options;
      options.domain = domain.number();
      options.name = "wave" + std::to_string(wave);  // one participant for each wave
      options.catch_up = means;
      mirrors.push_back(std::make_unique<MapMirror>(options));
    }
    for (int i = 0; i < kPerWave; ++i) {
      const MapMirror& mirror = *mirrors[i];
      // The map goes on; what counts is a moment at which the copy says that it is right.
      ASSERT_TRUE(
          mirror.wait_until([&](const MirrorStatus& status) { return whole(status); }, kGenerous))
          << "wave " << wave << " mirror " << i << ": " << mirror.status().stale_because;
      const MirrorContents contents = mirror.contents();
      std::vector<MapTile> tiles;
      for (const auto& entry : contents.tiles) tiles.push_back(entry.second);
      ASSERT_EQ(map_digest(tiles), contents.status.digest);
      ASSERT_EQ(contents.status.digest, map.source.history_at(contents.status.version));
      ASSERT_GE(contents.status.gathered + contents.status.snapshots_taken, 1u);
      if (means == CatchUp::kTiles) {
        gathered_by_tiles += contents.status.gathered;
        asked_by_tiles += contents.status.snapshots_asked;
      } else if (means == CatchUp::kSnapshot) {
        gathered_by_snapshot += contents.status.gathered;
      }
    }
  }
  EXPECT_GT(gathered_by_tiles, static_cast<std::uint64_t>(2 * kPerWave));
  EXPECT_EQ(asked_by_tiles, 0u);
  EXPECT_EQ(gathered_by_snapshot, 0u);
}

// A step of a third of a megabyte, and its tiles, leave at 0.3 MB/s. What is written when its first
// tile has arrived comes before its last one: an event, because events do not wait for map data,
// and the delta of the next step, because deltas go before tiles.
TEST(MapBus, EventsAndDeltasOvertakeTheTiles) {
  const TestDomain domain;
  MapSource source(domain, 5, 0.3);
  dds::Writer<pocd_msgs::msg::ObjectEventPubSubType> events(source.participant,
                                                            dds::topics::kObjectEvents);
  const auto subscriber = test_participant(domain);
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::ObjectEventPubSubType> event_reader(
      subscriber, dds::topics::kObjectEvents, wakeup);
  dds::Reader<pocd_msgs::msg::MapDeltaPubSubType> delta_reader(subscriber, dds::topics::kMapDeltas,
                                                               wakeup);
  dds::Reader<pocd_msgs::msg::MapTilePubSubType> tile_reader(subscriber, dds::topics::kMapTiles,
                                                             wakeup);
  const auto take_delta = [&](std::uint64_t version) {
    pocd_msgs::msg::MapDelta delta;
    dds::SampleMeta meta;
    bool found = false;
    while (delta_reader.take(delta, meta)) found = found || delta.version() == version;
    return found;
  };
  // Volatile writers have to know their readers; a step and a tile that arrive show that they do.
  std::set<std::array<std::uint8_t, 16>> tiles;
  dds::SampleMeta meta;
  ASSERT_TRUE(eventually([&] {
    fill_block(source.map, {0, 0, 0}, source.random);
    source.publish();
    pocd_msgs::msg::MapTile tile;
    while (tile_reader.take(tile, meta)) tiles.insert(meta.key);
    return events.matched() > 0 && !tiles.empty() &&
           take_delta(source.publication.publisher().version());
  }));
  tiles.clear();
  for (int x = 2; x < 26; ++x) {
    for (int y = 0; y < 20; ++y) fill_block(source.map, {x, y, 0}, source.random);
  }
  source.publish();
  constexpr std::size_t kAll = 12 * 10;
  ASSERT_GT(source.publication.publisher().bytes(), 300'000u);
  std::optional<std::size_t> before_event, before_delta;
  const std::uint64_t next = source.publication.publisher().version() + 1;
  bool written = false;
  const bool complete = eventually([&] {
    source.turn();
    pocd_msgs::msg::ObjectEvent event;
    if (event_reader.take(event, meta) && !before_event) before_event = tiles.size();
    if (take_delta(next) && !before_delta) before_delta = tiles.size();
    pocd_msgs::msg::MapTile tile;
    while (tile_reader.take(tile, meta)) {
      if (tile.x() > 0) tiles.insert(meta.key);
    }
    if (!tiles.empty() && !written) {
      written = true;
      pocd_msgs::msg::ObjectEvent sent;
      events.write(sent);
      fill_block(source.map, {0, 0, 0}, source.random);
      source.publish();
    }
    return tiles.size() == kAll && before_event && before_delta;
  });
  ASSERT_TRUE(complete) << tiles.size() << " of " << kAll << " tiles";
  EXPECT_LT(*before_event, kAll);
  EXPECT_LT(*before_delta, kAll);
}

// Without subscribers nothing holds the writers back. What sends has more to do than to send tiles:
// it tells the node's state and answers.
TEST(MapBus, ATurnEndsHoweverMuchIsWaiting) {
  constexpr int kSide = 160;  // blocks: 100 MB of tiles
  const TestDomain domain;
  MapSource source(domain, 5, 100.0);
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) fill_block(source.map, {x, y, 0}, source.random);
  }
  source.publish();
  const std::size_t tiles = source.publication.traffic().tiles;
  EXPECT_EQ(tiles, kSide * kSide / 4u);
  EXPECT_GT(source.publication.waiting(), 0u) << "all of it went in one turn";
  EXPECT_TRUE(eventually([&] {
    source.turn();
    return source.publication.waiting() == 0;
  }));
}

// A node that goes on with a memory writes all of it for late joiners. Who asks for it does not
// wait until that is done.
TEST(MapBus, WhoAsksGoesBeforeWhatIsKept) {
  constexpr int kSide = 40;  // blocks
  const TestDomain domain;
  MapSource source(domain, 6, 20.0);  // MB/s: the answer takes more than a turn
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) fill_block(source.map, {x, y, 0}, source.random);
  }
  source.publish();
  ASSERT_TRUE(eventually([&] {
    source.turn();
    return source.publication.waiting() == 0;
  }));
  const auto subscriber = test_participant(domain);
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::MapSnapshotReplyPubSubType> replies(
      subscriber, dds::topics::kSnapshotReply, wakeup);
  dds::Writer<pocd_msgs::msg::MapSnapshotRequestPubSubType> requests(subscriber,
                                                                     dds::topics::kSnapshotRequest);
  pocd_msgs::msg::MapSnapshotRequest request;
  pocd_msgs::msg::MapSnapshotReply reply;
  dds::SampleMeta meta;
  // The first answer shows that each side knows the other.
  ASSERT_TRUE(eventually([&] {
    if (source.publication.traffic().snapshots == 0) requests.write(request);
    source.turn();
    return replies.take(reply, meta);
  }));
  ASSERT_TRUE(eventually([&] {
    source.turn();
    while (replies.take(reply, meta)) {
    }
    return source.publication.waiting() == 0;
  }));
  source.publication.restored(1);
  const std::size_t kept = source.publication.waiting();
  ASSERT_EQ(kept, kSide * kSide / 4u);
  const std::uint64_t before = source.publication.traffic().snapshot_bytes;
  requests.write(request);
  ASSERT_TRUE(eventually([&] {
    source.publication.answer_requests();
    return source.publication.waiting() > kept;
  }));
  source.publication.send_waiting();
  EXPECT_GT(source.publication.traffic().snapshot_bytes, before);
  EXPECT_GE(source.publication.waiting(), kept) << "what is kept went first";
}

TEST(ByteBudget, SpendsItsRateAndSavesLittle) {
  using std::chrono::milliseconds;
  dds::ByteBudget budget(1e6);
  auto now = dds::ByteBudget::Time{} + milliseconds(1);
  std::size_t sent = 0;
  for (int turn = 0; turn < 1000; ++turn, now += milliseconds(7)) {
    while (budget.open(now)) budget.spend(3000), sent += 3000;
  }
  EXPECT_NEAR(static_cast<double>(sent), 1e6 * 6.993 + 20'000, 3000);
  // An hour without anything to send is worth 20 ms; one large message is paid for afterwards.
  now += std::chrono::hours(1);
  ASSERT_TRUE(budget.open(now));
  budget.spend(150'000);
  EXPECT_FALSE(budget.open(now + milliseconds(129)));
  EXPECT_TRUE(budget.open(now + milliseconds(131)));
}

// Objects and tiles come and go for as long as a node runs; a writer must not count the dead.
TEST(MapBus, RemovedInstancesMakeRoom) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Delivery few = dds::topics::kObjects.delivery;
  few.max_instances = 40;
  dds::Writer<pocd_msgs::msg::ObjectStatePubSubType> writer(bus, dds::topics::kObjects,
                                                            dds::topics::kObjects.name, few);
  const auto add_and_remove = [&](int from, int to) {
    pocd_msgs::msg::ObjectState state;
    for (int i = from; i < to; ++i) {
      state.uuid(dds::object_uuid(1, static_cast<ObjectId>(i)));
      ASSERT_TRUE(writer.write(state)) << i;
      if (i - 20 < from) continue;
      state.uuid(dds::object_uuid(1, static_cast<ObjectId>(i - 20)));
      ASSERT_TRUE(writer.dispose(state)) << i;
      // An instance is forgotten when all readers know of its end.
      if (i % 10 == 0) {
        ASSERT_TRUE(writer.wait_acknowledged(kGenerous));
      }
    }
  };
  add_and_remove(1, 1001);  // nobody listens
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::ObjectStatePubSubType> reader(
      test_participant(domain), dds::topics::kObjects, dds::topics::kObjects.name,
      dds::topics::kObjects.delivery, wakeup);
  std::set<std::array<std::uint8_t, 16>> present;
  const auto take = [&] {
    pocd_msgs::msg::ObjectState state;
    dds::SampleMeta meta;
    while (reader.take(state, meta)) {
      if (meta.valid) present.insert(meta.key);
      if (meta.disposed) present.erase(meta.key);
    }
  };
  ASSERT_TRUE(eventually([&] {
    take();
    return present.size() == 20;
  })) << "what is there when one joins: "
      << present.size();
  std::atomic<bool> done{false};
  std::thread consumer([&] {
    while (!done) {
      wakeup.wait_for(std::chrono::milliseconds(20));
      take();
    }
  });
  for (int i = 981; i < 1001; ++i) {
    pocd_msgs::msg::ObjectState state;
    state.uuid(dds::object_uuid(1, static_cast<ObjectId>(i)));
    writer.dispose(state);
  }
  EXPECT_TRUE(writer.wait_acknowledged(kGenerous));
  add_and_remove(2001, 2401);
  EXPECT_TRUE(writer.wait_acknowledged(kGenerous));
  done = true;
  wakeup.wake();
  consumer.join();
  take();
  EXPECT_EQ(present.size(), 20u);
  EXPECT_EQ(writer.failures(), 0u);
}

}  // namespace
}  // namespace pocd
