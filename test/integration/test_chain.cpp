// The whole chain: simulator -> pocd_play -> pocd_node -> subscribers, beside the offline run.
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <set>
#include <thread>

#include "bus_harness.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/config/run_summary.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/map_mirror.hpp"

namespace pocd {
namespace {

RunSummary offline(const std::string& input, const std::filesystem::path& output,
                   const std::vector<std::string>& more = {}) {
  std::vector<std::string> command{bin("pocd_map"),
                                   "--dataset",
                                   "sim",
                                   "--input",
                                   input,
                                   "--config",
                                   source("config/simulated.yaml"),
                                   "--output",
                                   output.string()};
  command.insert(command.end(), more.begin(), more.end());
  const CommandResult result = run_command(command);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  RunSummary summary;
  load_config(summary, {output / "summary.yaml"});
  return summary;
}

/// Reads objects with their disposes as they come, like a fleet manager. (Read at the end only, the
/// dispose would have taken the place of the state: the topic keeps the last sample of an object.)
class ObjectWatch {
 public:
  explicit ObjectWatch(const TestDomain& domain)
      : states_(test_participant(domain), dds::topics::kObjects, wakeup_), thread_([this] {
          while (!stopping_) {
            wakeup_.wait_for(std::chrono::milliseconds(50));
            take();
          }
        }) {}
  ~ObjectWatch() { stop(); }

  /// Takes what has arrived; the members below may be looked at from then on.
  void stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wakeup_.wake();
    thread_.join();
    take();
  }
  bool matched() const { return states_.matched() > 0; }

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

  dds::Wakeup wakeup_;
  dds::Reader<pocd_msgs::msg::ObjectStatePubSubType> states_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

TEST(Chain, LiveEqualsOfflineAndRemovalIsDisposed) {
  const TemporaryFolder folder;
  const RunSummary expected = offline(scenario(), folder.path() / "offline");
  ASSERT_GT(expected.removed, 0u) << "the scenario has to have a removal to be a test";
  ASSERT_GT(expected.objects, 0u);

  const TestDomain domain;
  ObjectWatch objects(domain);
  Process node(node_command(domain, {"--lossless", "--epoch", "77"}));
  ASSERT_TRUE(eventually([&] { return objects.matched(); }));
  const auto output = folder.path() / "mirror";
  Process mirror(
      {bin("pocd_mirror"), "--until-end", "--domain", domain.text(), "--output", output.string()});
  const CommandResult played = run_command(play_command(domain));
  ASSERT_EQ(played.exit_code, 0) << played.err;
  node.signal(SIGINT);
  const CommandResult ended = node.wait();
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const CommandResult mirrored = mirror.wait();
  EXPECT_EQ(mirrored.exit_code, 0) << mirrored.err << mirrored.out;

  EXPECT_NE(mirrored.out.find("in step with publisher"), std::string::npos) << mirrored.out;
  EXPECT_NE(mirrored.out.find("digest " + expected.map_digest), std::string::npos)
      << mirrored.out << "offline " << expected.map_digest << "\n"
      << ended.err;
  EXPECT_NE(ended.err.find(std::to_string(expected.frames) + " frames processed, " +
                           std::to_string(expected.refused) + " refused"),
            std::string::npos)
      << ended.err;
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
      offline(scenario(), folder.path() / "offline", {fine[0], fine[1], "--max-frames", "25"});
  const TestDomain domain;
  Process node(
      node_command(domain, {"--lossless", fine[0], fine[1], "--set", "node.queue_frames=1"}));
  Process mirror({bin("pocd_mirror"), "--until-end", "--domain", domain.text()});
  ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "25"})).exit_code, 0);
  node.signal(SIGINT);
  const CommandResult ended = node.wait();
  EXPECT_NE(ended.err.find("25 frames processed"), std::string::npos) << ended.err;
  const CommandResult mirrored = mirror.wait();
  EXPECT_NE(mirrored.out.find("digest " + expected.map_digest), std::string::npos)
      << mirrored.out << mirrored.err << "offline " << expected.map_digest;
}

// Frames of two robots reach the pipeline in one order, whatever the order of arrival.
TEST(Chain, TwoRobotsLiveEqualOffline) {
  const TemporaryFolder folder;
  const std::string demo = source("config/sim/demo.yaml");
  const RunSummary expected = offline(demo, folder.path() / "offline", {"--max-frames", "60"});
  const TestDomain domain;
  Process node(node_command(domain, {"--robot", "robot2", "--lossless"}));
  Process mirror({bin("pocd_mirror"), "--until-end", "--domain", domain.text()});
  const CommandResult played =
      run_command({bin("pocd_play"), "--dataset", "sim", "--input", demo, "--fast", "--lossless",
                   "--max-frames", "60", "--domain", domain.text()});
  ASSERT_EQ(played.exit_code, 0) << played.err;
  node.signal(SIGINT);
  ASSERT_EQ(node.wait().exit_code, 0);
  const CommandResult mirrored = mirror.wait();
  EXPECT_NE(mirrored.out.find("digest " + expected.map_digest), std::string::npos)
      << mirrored.out << mirrored.err << "offline " << expected.map_digest;
}

}  // namespace
}  // namespace pocd
