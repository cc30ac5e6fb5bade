// More robots than a node listens to.
#include <gtest/gtest.h>

#include <set>

#include "bus_harness.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/intake.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd {
namespace {

TEST(Intake, TurnsRobotsAwayAndMeetsThemWhenThereIsRoom) {
  constexpr std::size_t kMost = 200;
  const TestDomain domain;
  dds::BusWatch watch;
  dds::BusOptions options{domain.number(), "", "intake"};
  options.listener = &watch;
  NodeConfig config;
  config.segmentation = "absent";
  dds::FrameQueue queue(1);
  dds::LatencyLog latency("");
  dds::Intake intake(std::make_shared<dds::Participant>(options), config, PipelineConfig{}, watch,
                     queue, latency);
  const auto names = [&] {
    std::set<std::string> present;
    for (const auto& robot : intake.status().robots) {
      if (robot.live) present.insert(robot.name);
    }
    return present;
  };
  const auto bus = test_participant(domain);
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

}  // namespace
}  // namespace pocd
