// Many robots: more than a node listens to, and what each of them costs.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "pocd_dds/node/intake.hpp"
#include "robot_sender.hpp"

namespace pocd {
namespace {

/// A node's intake on a domain of its own. Members are made in the order of their declaration.
struct IntakeOnABus {
  const TestDomain domain;
  dds::BusWatch watch;
  NodeConfig config = without_masks();
  dds::FrameQueue queue{1};
  dds::LatencyLog latency{""};
  dds::Intake intake{listening(domain, watch), config, PipelineConfig{}, watch, queue, latency};

 private:
  static NodeConfig without_masks() {
    NodeConfig config;
    config.segmentation = StreamUse::kAbsent;
    return config;
  }
  static std::shared_ptr<dds::Participant> listening(const TestDomain& domain,
                                                     dds::BusWatch& watch) {
    dds::BusOptions options{domain.number(), "", "intake"};
    options.listener = &watch;
    return std::make_shared<dds::Participant>(options);
  }
};

TEST(Intake, TurnsRobotsAwayAndMeetsThemWhenThereIsRoom) {
  constexpr std::size_t kMost = 200;
  IntakeOnABus node;
  dds::Intake& intake = node.intake;
  const auto names = [&] {
    std::set<std::string> present;
    for (const auto& robot : intake.status().robots) {
      if (robot.live) present.insert(robot.name);
    }
    return present;
  };
  const auto bus = test_participant(node.domain);
  using Writer = dds::Writer<sensor_msgs::msg::ImagePubSubType>;
  std::map<std::string, std::unique_ptr<Writer>> robots;
  for (std::size_t i = 0; i < kMost + 2; ++i) {
    const std::string name = "r" + std::to_string(1000 + i);
    robots[name] = std::make_unique<Writer>(
        bus, dds::topics::kDepth, "rt/" + name + "/depth/image_raw", dds::topics::best_effort(1));
  }
  const auto turned_away = [&] {
    std::set<std::string> topics;
    for (const auto& problem : intake.status().problems) {
      if (problem.reason == "too_many_robots") topics.insert(problem.topic);
    }
    return topics;
  };
  ASSERT_TRUE(eventually([&] { return names().size() == kMost && turned_away().size() == 2; }));

  std::set<std::string> deaf;
  for (const auto& robot : robots) deaf.insert(robot.first);
  for (const std::string& name : names()) deaf.erase(name);
  ASSERT_EQ(deaf.size(), 2u);
  const std::string leaves = *deaf.begin(), waits = *deaf.rbegin(), heard = *names().begin();
  robots.erase(leaves);
  robots.erase(heard);
  ASSERT_TRUE(eventually([&] { return names().count(waits) > 0; }));
  EXPECT_EQ(names().size(), kMost);
  const auto departures = intake.status().departures;
  ASSERT_EQ(departures.size(), 1u) << "who was not listened to cannot depart";
  EXPECT_EQ(departures[0].name, heard);
  intake.stop();
  intake.rethrow();
}

// 12 robots with 10 broadcasters each, all there before the node has time to look.
TEST(Intake, KeepsEveryStaticTransformOfAFleet) {
  constexpr int kBroadcasters = 150;
  const TestDomain domain;
  const auto bus = test_participant(domain), other = test_participant(domain);
  dds::Wakeup wakeup;
  dds::TransformInput input(bus, "rt/tf", "rt/tf_static", dds::topics::kTf.delivery, wakeup);
  using Writer = dds::Writer<tf2_msgs::msg::TFMessagePubSubType>;
  std::vector<std::unique_ptr<Writer>> broadcasters;
  for (int i = 0; i < kBroadcasters; ++i) {
    broadcasters.push_back(std::make_unique<Writer>(other, dds::topics::kTfStatic, "rt/tf_static",
                                                    dds::topics::latched(1)));
    tf2_msgs::msg::TFMessage message;
    message.transforms().push_back(
        dds::transform_message({"map", "camera" + std::to_string(i), 1, {}}));
    ASSERT_TRUE(broadcasters.back()->write(message));
  }
  ASSERT_TRUE(eventually([&] {
    return std::all_of(broadcasters.begin(), broadcasters.end(), [](const auto& broadcaster) {
      return broadcaster->matched() > 0 && broadcaster->wait_acknowledged(kGenerous);
    });
  }));
  TransformTree tree(1'000'000'000);
  dds::ProblemCounter problems;
  int known = 0;
  EXPECT_TRUE(eventually([&] {
    input.drain_static(tree, problems);
    known = 0;
    for (int i = 0; i < kBroadcasters; ++i) {
      known += tree.lookup("map", "camera" + std::to_string(i), 1, 0).result == PoseLookup::kFound;
    }
    return known == kBroadcasters;
  })) << known;
}

// What one robot sends costs a look at that robot, not at the fleet.
TEST(Intake, ASampleCostsALookAtItsRobotOnly) {
  constexpr int kRobots = 40, kSamples = 400;
  IntakeOnABus node;
  dds::Intake& intake = node.intake;
  const auto bus = test_participant(node.domain);
  std::vector<std::unique_ptr<RobotSender>> robots;
  for (int i = 0; i < kRobots; ++i) {
    robots.push_back(std::make_unique<RobotSender>(bus, "r" + std::to_string(i)));
  }
  ASSERT_TRUE(eventually([&] {
    return std::all_of(robots.begin(), robots.end(),
                       [](const auto& robot) { return robot->matched(); });
  }));
  const auto looks = [&] { return intake.status().visits; };
  // Its status is of the last look at everybody; as long as nothing comes these are all there are.
  const auto started = std::chrono::steady_clock::now();
  const std::uint64_t before = looks();
  for (StampNs i = 1; i <= kSamples; ++i) {
    robots[0]->send_odometry({"map", "base", i * 10'000'000, {}});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(250));
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  // Everybody every 100 ms, one robot with each sample, and twice that as a margin.
  const double most = 2.0 * (kRobots * (elapsed_s / 0.1 + 2.0) + kSamples);
  EXPECT_LT(static_cast<double>(looks() - before), most);
  EXPECT_LT(most, kRobots * kSamples) << "the test says something";
  intake.stop();
  intake.rethrow();
}

}  // namespace
}  // namespace pocd
