// The whole chain: simulator -> pocd_play -> pocd_node -> subscribers, beside the offline run.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "pocd_dds/bridge/object_messages.hpp"
#include "whole_run.hpp"

namespace pocd {
namespace {

/// Objects with their disposes, as a fleet manager takes them.
class ObjectLog {
 public:
  explicit ObjectLog(const TestDomain& domain) : ObjectLog(test_participant(domain)) {}
  explicit ObjectLog(const std::shared_ptr<dds::Participant>& bus)
      : states_(bus, dds::topics::kObjects, taker_.wakeup()), behind_(bus) {
    taker_.start([this] { take(); });
  }
  ~ObjectLog() { stop(); }  // before the readers go
  void stop() { taker_.stop(); }
  /// From here on every state is heard: a node whose health has come in by a reader that was made
  /// later has found this one, too.
  bool matched() { return states_.matched() > 0 && behind_.newest() != nullptr; }

  // To be looked at after stop().
  std::map<std::array<std::uint8_t, 16>, pocd_msgs::msg::ObjectState> present;
  std::set<std::array<std::uint8_t, 16>> ever;
  int disposed = 0;

 private:
  void take() {
    pocd_msgs::msg::ObjectState state;
    dds::SampleMeta meta;
    while (states_.take(state, meta)) {
      if (meta.valid) {
        present[state.uuid()] = state;
        ever.insert(state.uuid());
      } else if (meta.disposed) {
        EXPECT_EQ(present.erase(meta.key), 1u) << "a dispose of an object that is not there";
        ++disposed;
      }
    }
  }

  Taker taker_;
  dds::Reader<pocd_msgs::msg::ObjectStatePubSubType> states_;
  HealthWatch behind_;  // made after the reader
};

TEST(Chain, LiveEqualsOfflineAndRemovalIsDisposed) {
  const TemporaryFolder folder;
  const RunSummary expected = offline_run(scenario(), folder.path() / "offline");
  ASSERT_GT(expected.removed, 0u) << "the scenario has to have a removal to be a test";
  ASSERT_GT(expected.objects, 0u);

  const TestDomain domain;
  ObjectLog objects(domain);
  Process node(node_command(domain, {"--lossless", "--epoch", "77"}));
  ASSERT_TRUE(eventually([&] { return objects.matched(); }));
  const auto output = folder.path() / "mirror";
  const std::string said =
      play_and_compare(domain, node, play_command(domain), expected, {"--output", output.string()});
  EXPECT_NE(said.find(std::to_string(expected.frames) + " frames processed, " +
                      std::to_string(expected.refused) + " refused"),
            std::string::npos)
      << said;
  EXPECT_TRUE(std::filesystem::file_size(output / "map.ply") > 1000);
  EXPECT_EQ(read_text(output / "map.ply").size(),
            read_text(folder.path() / "offline" / "map.ply").size());

  objects.stop();
  EXPECT_EQ(objects.present.size(), expected.objects);
  EXPECT_EQ(objects.disposed, static_cast<int>(expected.removed));
  EXPECT_EQ(objects.ever.size(), expected.objects + expected.removed);
  for (const auto& [key, state] : objects.present) {
    EXPECT_EQ(key, dds::object_uuid(77, ObjectId{state.local_id()}));
    EXPECT_EQ(state.class_name(), "box");
  }
}

// A pipeline that is slower than the player and a queue of one frame: without being held back, the
// player would make the node drop frames.
TEST(Chain, LosslessHoldsThePlayerBack) {
  const TemporaryFolder folder;
  const std::vector<std::string> fine{"--set", "map.voxel_size_m=0.005"};
  const RunSummary expected =
      offline_run(scenario(), folder.path() / "offline", {fine[0], fine[1], "--max-frames", "25"});
  const TestDomain domain;
  Process node(
      node_command(domain, {"--lossless", fine[0], fine[1], "--set", "node.queue_frames=1"}));
  const std::string said =
      play_and_compare(domain, node, play_command(domain, {"--max-frames", "25"}), expected);
  EXPECT_NE(said.find("25 frames processed"), std::string::npos) << said;
}

// Frames of two robots reach the pipeline in one order, whatever the order of arrival.
TEST(Chain, TwoRobotsLiveEqualOffline) {
  const TemporaryFolder folder;
  const std::string demo = source("config/sim/demo.yaml");
  const RunSummary expected = offline_run(demo, folder.path() / "offline", {"--max-frames", "60"});
  const TestDomain domain;
  Process node(node_command(domain, {"--robot", "robot2", "--lossless"}));
  play_and_compare(domain, node, play_command(domain, {"--max-frames", "60"}, demo), expected);
}

}  // namespace
}  // namespace pocd
