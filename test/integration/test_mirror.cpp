// Subscribers that come late, and publishers that go without a word.
#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "bus_harness.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_dds/object_watch.hpp"

namespace pocd {
namespace {

MirrorOptions on(const TestDomain& domain) {
  MirrorOptions options;
  options.domain = domain.number();
  return options;
}

bool whole(const MirrorStatus& status) { return status.in_step && status.version > 0; }

TEST(Mirror, LateJoinerConvergesToTheSameDigest) {
  const TestDomain domain;
  Process node(node_command(domain, {"--lossless"}));
  MapMirror early(on(domain));
  ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "90"})).exit_code, 0);
  ASSERT_TRUE(early.wait_until(whole, kGenerous));

  MapMirror late(on(domain));
  // Both follow to the very end of the run, whatever the node still had in its queue.
  ASSERT_TRUE(late.wait_until(whole, kGenerous));
  EXPECT_GT(late.status().snapshots_taken + late.status().gathered, 0u)
      << "deltas alone cannot have made this copy";
  node.signal(SIGINT);
  const auto finished = [](const MirrorStatus& status) { return status.final_version; };
  ASSERT_TRUE(early.wait_until(finished, kGenerous)) << early.status().stale_because;
  ASSERT_TRUE(late.wait_until(finished, kGenerous)) << late.status().stale_because;
  EXPECT_EQ(node.wait().exit_code, 0);
  EXPECT_EQ(late.status().digest, early.status().digest);
  EXPECT_EQ(late.status().tiles, early.status().tiles);
  EXPECT_EQ(late.status().objects, early.status().objects);
  EXPECT_GT(late.status().tiles, 0u);
}

TEST(Mirror, NewRunAfterAKilledPublisherIsNoticedAndTakenOver) {
  const TestDomain domain;
  MapMirror mirror(on(domain));
  {
    Process node(node_command(domain, {"--lossless", "--epoch", "1"}));
    ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "60"})).exit_code, 0);
    ASSERT_TRUE(mirror.wait_until(whole, kGenerous));
    EXPECT_EQ(mirror.status().epoch, 1u);
    node.signal(SIGKILL);
    EXPECT_EQ(node.wait().exit_code, 128 + SIGKILL);
    // Noticed when the lease is over, although no word was said.
    ASSERT_TRUE(
        mirror.wait_until([](const MirrorStatus& status) { return !status.in_step; }, kGenerous));
    EXPECT_EQ(mirror.status().stale_because, "the publisher has gone without ending its run");
  }
  Process node(node_command(domain, {"--lossless", "--epoch", "2"}));
  ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "60"})).exit_code, 0);
  EXPECT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.epoch == 2 && whole(status); }, kGenerous))
      << mirror.status().stale_because;
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
}

// A node that is killed takes no object away; a new run on the same map takes the place of its own.
TEST(ObjectWatch, ObjectsGoWhenRemovedOrReplacedAndNotWithTheirNode) {
  const TestDomain domain;
  std::mutex mutex;
  std::map<std::array<std::uint8_t, 16>, std::uint32_t> present;
  std::vector<std::string> said;
  ObjectWatchOptions options;
  options.domain = domain.number();
  options.map_id = 3;
  options.on_object = [&](const WatchedObject& object) {
    const std::lock_guard<std::mutex> lock(mutex);
    present[object.uuid] = to_index(object.state.id);
  };
  options.on_gone = [&](const WatchedObject& object, Gone why) {
    const std::lock_guard<std::mutex> lock(mutex);
    EXPECT_EQ(present.erase(object.uuid), 1u);
    said.push_back((why == Gone::kRemoved ? "removed " : "replaced ") +
                   std::to_string(to_index(object.state.id)));
  };
  const ObjectWatch watch(options);
  const auto count = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return present.size();
  };
  const auto write = [](auto& objects, const dds::MapRun& run, std::uint32_t id) {
    ObjectSnapshot object;
    object.id = static_cast<ObjectId>(id);
    auto state = dds::object_message(object, run, ClassMap{}, 1, "map");
    EXPECT_TRUE(objects.write(state));
    return state;
  };
  using Objects = dds::Writer<pocd_msgs::msg::ObjectStatePubSubType>;
  using Manifests = dds::Writer<pocd_msgs::msg::MapManifestPubSubType>;
  const auto announce = [](Manifests& manifests, const dds::MapRun& run) {
    pocd_msgs::msg::MapManifest manifest;
    manifest.map_id(run.map_id);
    manifest.epoch(run.epoch);
    EXPECT_TRUE(manifests.write(manifest));
  };
  // A node of another map is there all the time.
  const auto beside = test_participant(domain);
  Objects others(beside, dds::topics::kObjects);
  Manifests other_manifests(beside, dds::topics::kMapManifest);
  announce(other_manifests, {4, 8});
  write(others, {4, 8}, 50);
  auto manifests = std::make_unique<Manifests>(test_participant(domain), dds::topics::kMapManifest);
  auto first = std::make_unique<Objects>(test_participant(domain), dds::topics::kObjects);
  announce(*manifests, {3, 1});
  for (const std::uint32_t id : {1, 2}) write(*first, {3, 1}, id);
  auto state = write(*first, {3, 1}, 3);
  ASSERT_TRUE(eventually([&] { return count() == 3; }));
  EXPECT_TRUE(eventually([&] { return watch.publisher_present(); }));
  EXPECT_TRUE(first->dispose(state));
  ASSERT_TRUE(eventually([&] { return count() == 2; }));
  first.reset();
  manifests.reset();
  ASSERT_TRUE(eventually([&] { return !watch.publisher_present(); }));
  Objects second(test_participant(domain), dds::topics::kObjects);
  manifests = std::make_unique<Manifests>(test_participant(domain), dds::topics::kMapManifest);
  announce(*manifests, {3, 2});
  ASSERT_TRUE(eventually([&] { return watch.publisher_present(); }));
  EXPECT_EQ(count(), 2u) << "nobody has seen that the places are free";
  write(second, {3, 2}, 9);
  ASSERT_TRUE(eventually([&] { return count() == 1; }));
  const std::lock_guard<std::mutex> lock(mutex);
  EXPECT_EQ(said, (std::vector<std::string>{"removed 3", "replaced 1", "replaced 2"}));
}

// With both waiting, the state of the instance is that of the last.
TEST(Reader, AStateBeforeADisposeIsAState) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  dds::Delivery every = dds::topics::kObjects.delivery;
  every.keep_last = 0;
  every.max_instances = 0;
  dds::Reader<pocd_msgs::msg::ObjectStatePubSubType> reader(
      bus, dds::topics::kObjects, dds::topics::kObjects.name, every, wakeup);
  dds::Writer<pocd_msgs::msg::ObjectStatePubSubType> writer(bus, dds::topics::kObjects);
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0; }));
  auto state = dds::object_message(ObjectSnapshot{}, {3, 1}, ClassMap{}, 1, "map");
  EXPECT_TRUE(writer.write(state));
  EXPECT_TRUE(writer.dispose(state));
  ASSERT_TRUE(writer.wait_acknowledged(kGenerous));
  dds::SampleMeta meta;
  ASSERT_TRUE(reader.take(state, meta));
  EXPECT_TRUE(meta.valid);
  EXPECT_FALSE(meta.disposed);
  ASSERT_TRUE(reader.take(state, meta));
  EXPECT_FALSE(meta.valid);
  EXPECT_TRUE(meta.disposed);
}

TEST(Mirror, WithoutAPublisherItSaysSo) {
  const TestDomain domain;
  const CommandResult result =
      run_command({bin("pocd_mirror"), "--until-end", "--timeout", "1", "--domain", domain.text()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.out.find("stale, because no publisher heard of yet"), std::string::npos);
}

}  // namespace
}  // namespace pocd
