#include "pocd/map/map_follower.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <functional>

#include "map_history.hpp"

namespace pocd::testing {
namespace {

/// What the publisher of a history sends on its topics.
struct Sender {
  const History& history;
  std::uint64_t epoch;

  MapDigest digest(std::uint64_t version) const { return History::digest(history.maps[version]); }
  MapSnapshot snapshot(std::uint64_t version, std::uint64_t base) const {
    MapSnapshot s{epoch, base, version, digest(version), {}, {}};
    for (const auto& [key, tile] : history.maps[version]) {
      s.present.push_back(key);
      if (tile.version > base) s.changed.push_back(tile);
    }
    return s;
  }
};

TEST(MapFollower, ALateJoinerIsMadeOfTilesAndAManifest) {
  Random random(3);
  const History h(random, 9, 8);
  const Sender sender{h, 9};
  MapFollower follower;
  EXPECT_EQ(follower.stale_because(), "no publisher heard of yet");
  follower.published(9, 6, sender.digest(6));
  EXPECT_EQ(follower.stale_because(), "at version 0, the publisher is at 6");
  follower.start_gathering();
  // Tiles of version 7 are on their way before anything says that there is one.
  for (const auto& [key, tile] : h.maps[7]) {
    EXPECT_FALSE(follower.current());
    follower.tile(9, tile);
  }
  EXPECT_FALSE(follower.current());
  follower.delta(h.deltas[6]);
  EXPECT_TRUE(follower.current()) << follower.stale_because();
  EXPECT_EQ(follower.counts().gathered, 1u);
  EXPECT_EQ(contents(follower.replica().tiles()), contents(h.maps[7]));
  follower.stop_gathering();
  follower.delta(h.deltas[7]);
  EXPECT_TRUE(follower.current());
  EXPECT_EQ(follower.replica().version(), 8u);
}

TEST(MapFollower, TilesOfANewRunCountEvenWhenTheyComeBeforeItsManifest) {
  Random random(4);
  const History old_run(random, 1, 5), new_run(random, 2, 3);
  MapFollower follower;
  follower.published(1, 0, {});
  for (const MapDelta& delta : old_run.deltas) follower.delta(delta);
  EXPECT_TRUE(follower.current());
  follower.start_gathering();
  for (const auto& [key, tile] : new_run.maps[3]) follower.tile(2, tile);
  EXPECT_TRUE(follower.current()) << "nothing says yet that the old run is over";
  follower.published(2, 3, Sender{new_run, 2}.digest(3));
  EXPECT_TRUE(follower.current()) << follower.stale_because();
  EXPECT_EQ(contents(follower.replica().tiles()), contents(new_run.maps[3]));
}

TEST(MapFollower, APartialSnapshotNeedsItsBase) {
  Random random(5);
  const History h(random, 1, 9);
  const Sender sender{h, 1};
  MapFollower follower;
  follower.published(1, 9, sender.digest(9));
  EXPECT_FALSE(follower.has_base());
  EXPECT_FALSE(follower.snapshot(sender.snapshot(9, 4)));
  EXPECT_TRUE(follower.snapshot(sender.snapshot(5, 0)));
  EXPECT_TRUE(follower.has_base());
  EXPECT_FALSE(follower.snapshot(sender.snapshot(9, 6)));
  EXPECT_TRUE(follower.snapshot(sender.snapshot(9, 4)));
  EXPECT_TRUE(follower.current());
  EXPECT_EQ(contents(follower.replica().tiles()), contents(h.maps[9]));
  EXPECT_EQ(follower.counts().corrupt, 0u);
}

/// Loses, repeats and delays samples, each with a probability of 20 %.
class Channel {
 public:
  explicit Channel(Random& random) : random_(random) {}
  void send(const std::function<void()>& sample) {
    if (loss && random_.uniform() < 0.2) return;
    const int copies = loss && random_.uniform() < 0.2 ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      const bool late = loss && random_.uniform() < 0.2;
      queue_.emplace(clock_ + (late ? random_.below(40) : 0), sample);
    }
  }
  /// Delivers one sample; false when there is none.
  bool deliver() {
    ++clock_;
    if (queue_.empty()) return false;
    const auto sample = queue_.begin()->second;
    queue_.erase(queue_.begin());
    sample();
    return true;
  }
  bool loss = true;

 private:
  Random& random_;
  std::uint64_t clock_ = 0;
  std::multimap<std::uint64_t, std::function<void()>> queue_;
};

/// A run of one publisher over a bad bus. The follower asks for snapshots and tiles at random.
class LossyRun {
 public:
  LossyRun(Random& random, MapFollower& follower, Channel& channel, const Sender& sender,
           std::uint64_t seed)
      : random_(random), follower_(follower), channel_(channel), sender_(sender), seed_(seed) {}

  void drive() {
    const std::uint64_t last = sender_.history.deltas.size();
    for (version_ = 1; version_ <= last; ++version_) {
      send_step();
      if (random_.uniform() < 0.3) send_manifest();
      recover(0.3);
      for (std::uint64_t n = random_.below(12); n-- > 0;) step();
    }
    version_ = last;
  }
  /// From here on nothing is lost: whatever happened before, the copy becomes the publisher's.
  void settle() {
    channel_.loss = false;
    for (int round = 0; round < 3; ++round) {
      send_manifest();
      drain();
      recover(1.0);
      drain();
    }
    ASSERT_TRUE(follower_.current()) << "seed " << seed_ << ": " << follower_.stale_because();
    ASSERT_EQ(follower_.replica().version(), version_) << "seed " << seed_;
  }
  int claims = 0;

 private:
  void send_step() {
    const MapDelta& delta = sender_.history.deltas[version_ - 1];
    MapDelta sent = delta;
    if (random_.uniform() < 0.02 && !sent.changed.empty()) lengthen(sent.changed[0]);
    channel_.send([this, sent] {
      hear(sent.version);
      follower_.delta(sent);
    });
    for (const MapTile& tile : delta.changed) send_tile(tile);
    for (const TileKey& key : delta.removed) {
      channel_.send([this, key] { follower_.tile_gone(sender_.epoch, key); });
    }
  }
  void send_tile(const MapTile& tile) {
    channel_.send([this, tile] { follower_.tile(sender_.epoch, tile); });
  }
  void send_manifest() {
    channel_.send([this, at = version_] {
      hear(at);
      announced_ = true;
      follower_.published(sender_.epoch, at, sender_.digest(at));
    });
  }
  void recover(double probability) {
    if (follower_.current()) {
      follower_.stop_gathering();
      return;
    }
    if (random_.uniform() >= probability) return;
    if (random_.uniform() < 0.5) {
      const std::uint64_t base =
          follower_.has_base() && *follower_.replica().epoch() == sender_.epoch
              ? follower_.replica().version()
              : 0;
      MapSnapshot snapshot = sender_.snapshot(version_, std::min(base, version_));
      if (channel_.loss && random_.uniform() < 0.1 && !snapshot.present.empty()) {
        snapshot.present.pop_back();
      }
      channel_.send([this, s = std::move(snapshot)] {
        if (follower_.snapshot(s)) hear(s.version);
      });
    } else {
      follower_.start_gathering();
      for (const auto& entry : sender_.history.maps[version_]) send_tile(entry.second);
    }
  }
  void hear(std::uint64_t version) { heard_ = std::max(heard_, version); }
  void drain() {
    while (step()) {
    }
  }
  bool step() {
    if (!channel_.deliver()) return false;
    check();
    return true;
  }
  void check() {
    // Until this run is heard of, the follower may be right about the one before.
    if (!announced_ || !follower_.current()) return;
    const MapReplica& copy = follower_.replica();
    if (*copy.epoch() != sender_.epoch) return;
    ++claims;
    ASSERT_EQ(copy.version(), heard_) << "seed " << seed_;
    ASSERT_EQ(contents(copy.tiles()), contents(sender_.history.maps[heard_])) << "seed " << seed_;
  }

  Random& random_;
  MapFollower& follower_;
  Channel& channel_;
  const Sender sender_;
  const std::uint64_t seed_;
  std::uint64_t version_ = 0, heard_ = 0;
  bool announced_ = false;
};

// 20 % of all samples, of deltas, tiles, disposes, manifests and snapshots, are lost, 20 % come
// twice, 20 % come late; some deltas and snapshots are damaged; publishers restart. A follower that
// calls itself current holds exactly the map of the newest version it has heard of, and once
// nothing is lost any more it gets there.
TEST(MapFollower, NeverCallsAWrongMapRightAndRecovers) {
  int claims = 0;
  std::uint64_t gathered = 0, snapshots = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    Channel channel(random);
    MapFollower follower;
    const bool restarts = random.uniform() < 0.3;
    const History first(random, 100, 15), second(random, 101, 15);
    LossyRun run(random, follower, channel, {first, 100}, seed);
    ASSERT_NO_FATAL_FAILURE(run.drive());
    LossyRun next(random, follower, channel, {second, 101}, seed);
    if (restarts) {
      ASSERT_NO_FATAL_FAILURE(next.drive());
    }
    ASSERT_NO_FATAL_FAILURE((restarts ? next : run).settle());
    claims += run.claims + next.claims;
    gathered += follower.counts().gathered;
    snapshots += follower.counts().snapshots;
  }
  // The test sees all cases often enough to mean something.
  EXPECT_GT(claims, 3000);
  EXPECT_GT(gathered, 300u);
  EXPECT_GT(snapshots, 300u);
}

}  // namespace
}  // namespace pocd::testing
