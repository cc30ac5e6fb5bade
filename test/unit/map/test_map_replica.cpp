#include "pocd/map/map_replica.hpp"

#include <gtest/gtest.h>

#include "map_fixtures.hpp"
#include "map_history.hpp"

namespace pocd::testing {
namespace {

TEST(MapReplica, FollowsAPublisherToItsDigest) {
  const TsdfConfig config = coarse_config();
  TsdfMap map(config);
  ThreadPool pool(1);
  MapPublisher publisher(5, config);
  MapReplica replica;
  EXPECT_EQ(replica.stale_because(), "nothing received yet");
  int frame = 0;
  for (const Pose& pose : arc_of_poses(9, 12)) {
    map.integrate(look({2.5, {{{frame < 5 ? -0.3 : 0.4, 1.5, 1.0}, 0.3, 2}}}, pose).input(), pool);
    if (const auto delta = publisher.update(map)) {
      ASSERT_EQ(replica.apply(*delta), DeltaOutcome::kApplied);
    }
    ++frame;
  }
  map.clear_object(ObjectId{2});
  ASSERT_EQ(replica.apply(*publisher.update(map)), DeltaOutcome::kApplied);
  replica.note_published(5, publisher.version(), publisher.digest());
  EXPECT_TRUE(replica.current()) << replica.stale_because();
  EXPECT_EQ(replica.digest(), publisher.digest());
  EXPECT_EQ(contents(replica.tiles()), contents(publisher.tiles()));
}

TEST(MapReplica, SaysWhyItIsStale) {
  Random random(1);
  const History h(random, 7, 6);
  MapReplica replica;
  EXPECT_EQ(replica.apply(h.deltas[0]), DeltaOutcome::kApplied);
  EXPECT_EQ(replica.apply(h.deltas[0]), DeltaOutcome::kOld);
  EXPECT_TRUE(replica.current());
  EXPECT_EQ(replica.apply(h.deltas[2]), DeltaOutcome::kGap);
  EXPECT_EQ(replica.stale_because(), "at version 1, the publisher is at 3");
  EXPECT_EQ(replica.apply(h.deltas[1]), DeltaOutcome::kApplied);
  EXPECT_EQ(replica.apply(h.deltas[2]), DeltaOutcome::kApplied);
  EXPECT_TRUE(replica.current());
  replica.note_published(7, 5, h.deltas[4].digest);
  EXPECT_EQ(replica.stale_because(), "at version 3, the publisher is at 5");
  // A snapshot of 4 is not enough, and one with missing tiles is no snapshot.
  EXPECT_TRUE(replica.replace(7, 4, h.deltas[3].digest, History::list(h.maps[4])));
  EXPECT_FALSE(replica.current());
  std::vector<MapTile> incomplete = History::list(h.maps[5]);
  incomplete.pop_back();
  EXPECT_FALSE(replica.replace(7, 5, h.deltas[4].digest, incomplete));
  EXPECT_EQ(contents(replica.tiles()), contents(h.maps[4]));
  EXPECT_TRUE(replica.replace(7, 5, h.deltas[4].digest, History::list(h.maps[5])));
  EXPECT_TRUE(replica.current());
  // An older snapshot does not take it back.
  EXPECT_FALSE(replica.replace(7, 4, h.deltas[3].digest, History::list(h.maps[4])));

  MapDelta other = h.deltas[5];
  other.epoch = 8;
  EXPECT_EQ(replica.apply(other), DeltaOutcome::kWrongEpoch);
  EXPECT_EQ(replica.stale_because(), "the publisher runs in epoch 8, this copy is of epoch 7");
  // A snapshot of the other run that is older than what was heard of it.
  EXPECT_TRUE(replica.replace(8, 0, MapDigest{}, {}));
  EXPECT_TRUE(replica.tiles().empty());
  EXPECT_EQ(replica.stale_because(), "at version 0, the publisher is at 6");
}

TEST(MapReplica, DamagedContentIsNoticed) {
  Random random(2);
  const History h(random, 1, 4);
  MapReplica replica;
  MapDelta damaged = h.deltas[0];
  std::vector<std::uint8_t> payload = damaged.changed[0].payload.bytes();
  payload[0] = static_cast<std::uint8_t>(payload[0] ^ 1);
  damaged.changed[0].payload = payload;
  EXPECT_EQ(replica.apply(damaged), DeltaOutcome::kCorrupt);
  EXPECT_EQ(replica.stale_because(), "the digest of version 1 does not fit");
  EXPECT_EQ(replica.apply(h.deltas[1]), DeltaOutcome::kCorrupt);
  EXPECT_TRUE(replica.replace(1, 2, h.deltas[1].digest, History::list(h.maps[2])));
  EXPECT_TRUE(replica.current());
  replica.note_published(1, 2, h.deltas[2].digest);
  EXPECT_FALSE(replica.current());
}

// 20 % of the deltas are lost, 20 % come twice, 20 % change places with the next, some are damaged,
// manifests and snapshots come at random, publishers restart: whenever the replica claims to be
// current, it holds exactly the map of its version, and no newer one was heard of.
TEST(MapReplica, NeverCallsAWrongMapRight) {
  int claims = 0, recovered = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    MapReplica replica;
    std::vector<History> runs;
    runs.emplace_back(random, 100, 15);
    if (random.uniform() < 0.3) runs.emplace_back(random, 101, 15);
    for (const History& h : runs) {
      std::vector<MapDelta> sent;
      for (const MapDelta& delta : h.deltas) {
        if (random.uniform() < 0.2) continue;
        sent.push_back(delta);
        if (random.uniform() < 0.2) sent.push_back(delta);
        if (random.uniform() < 0.02 && !sent.back().changed.empty()) {
          lengthen(sent.back().changed[0]);
        }
      }
      for (std::size_t i = 0; i + 1 < sent.size(); ++i) {
        if (random.uniform() < 0.2) std::swap(sent[i], sent[i + 1]);
      }
      std::uint64_t heard = 0;
      for (const MapDelta& delta : sent) {
        replica.apply(delta);
        heard = std::max(heard, delta.version);
        const std::uint64_t at = random.below(h.maps.size());
        const MapDigest digest = History::digest(h.maps[at]);
        if (random.uniform() < 0.1) {
          replica.note_published(delta.epoch, at, digest);
          heard = std::max(heard, at);
        }
        if (random.uniform() < 0.1) {
          std::vector<MapTile> tiles = History::list(h.maps[at]);
          if (random.uniform() < 0.3 && !tiles.empty()) tiles.pop_back();
          if (replica.replace(delta.epoch, at, digest, tiles))
            heard = std::max(heard, at), ++recovered;
        }
        if (!replica.current()) continue;
        ++claims;
        ASSERT_EQ(*replica.epoch(), delta.epoch) << "seed " << seed;
        ASSERT_EQ(replica.version(), heard) << "seed " << seed;
        ASSERT_EQ(contents(replica.tiles()), contents(h.maps[replica.version()]))
            << "seed " << seed;
      }
    }
  }
  // The test sees both cases often enough to mean something.
  EXPECT_GT(claims, 1000);
  EXPECT_GT(recovered, 500);
}

TEST(MapReplica, ANewRunThatGoesOnWithTheSameMapIsFollowedAsItIs) {
  Random random(3);
  const History h(random, 7, 6);
  MapReplica replica;
  for (int i = 0; i < 4; ++i) replica.apply(h.deltas[static_cast<std::size_t>(i)]);
  // Of another version, or of another map: a snapshot is needed.
  replica.note_published(8, 5, h.deltas[4].digest);
  EXPECT_FALSE(replica.current());
  replica.note_published(8, 4, h.deltas[4].digest);
  EXPECT_FALSE(replica.current());
  EXPECT_EQ(replica.epoch(), 7u);
  replica.note_published(8, 4, h.deltas[3].digest);
  EXPECT_EQ(replica.epoch(), 8u);
  EXPECT_EQ(replica.stale_because(), "at version 4, the publisher is at 5") << "heard of before";
  MapDelta next = h.deltas[4];
  next.epoch = 8;
  EXPECT_EQ(replica.apply(next), DeltaOutcome::kApplied);
  EXPECT_TRUE(replica.current());
}

}  // namespace
}  // namespace pocd::testing
