// DDS Security: roles that may, and those who may not, as real participants with real certificates.
#include <gtest/gtest.h>

#include "pocd/common/check.hpp"
#include "pocd_dds/object_watch.hpp"
#include "preloaded.hpp"
#include "robot_sender.hpp"
#include "whole_run.hpp"

namespace pocd {
namespace {

/// Authorities, identities and permissions by the script that an operator uses.
class Authority {
 public:
  explicit Authority(const std::vector<std::string>& enclaves) {
    std::vector<std::string> command{source("launch_scripts/security/make_ca.sh"),
                                     folder_.path().string()};
    command.insert(command.end(), enclaves.begin(), enclaves.end());
    const CommandResult made = run_command(command);
    EXPECT_EQ(made.exit_code, 0) << made.err;
  }
  std::string of(const std::string& name) const { return (folder_.path() / name).string(); }

 private:
  TemporaryFolder folder_;
};

std::shared_ptr<dds::Participant> secured(const TestDomain& domain, const std::string& folder) {
  dds::BusOptions options{domain.number(), "", "pocd_test"};
  options.security_folder = folder;
  return std::make_shared<dds::Participant>(options);
}

template <class Make>
std::string refusal(const Make& make) {
  try {
    make();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// One to play, one to follow the map.
struct Roles {
  std::string player, follower;
};
class SecureRun : public ::testing::TestWithParam<Roles> {};

TEST_P(SecureRun, MakesTheSameMap) {
  const Authority authority({"component", "subscriber", "operator", "robot:robot1"});
  const TemporaryFolder folder;
  const std::vector<std::string> frames{"--max-frames", "30"};
  const RunSummary expected = offline_run(scenario(), folder.path() / "offline", frames);
  const TestDomain domain;
  Process node(fleet_command(domain, {"--lossless", "--security", authority.of("component")}));
  auto play = play_command(domain, frames);
  play.insert(play.end(), {"--security", authority.of(GetParam().player)});
  std::atomic<std::uint64_t> objects{0};
  ObjectWatchOptions watched;
  watched.domain = domain.number();
  watched.security_folder = authority.of(GetParam().follower);
  watched.on_object = [&](const WatchedObject&) { ++objects; };
  const ObjectWatch watch(watched);
  const std::string said = play_and_compare(
      domain, node, play, expected, {"--security", authority.of(GetParam().follower)}, [&] {
        EXPECT_TRUE(eventually([&] { return objects > 0; })) << "a watch with the follower's role";
      });
  EXPECT_NE(said.find("30 frames processed"), std::string::npos) << said;
}

INSTANTIATE_TEST_SUITE_P(Security, SecureRun,
                         ::testing::Values(Roles{"robot1", "subscriber"},
                                           Roles{"operator", "operator"}),
                         [](const auto& info) { return info.param.player; });

TEST(Security, WithoutAnIdentityOfThisAuthorityNobodyReadsOrWrites) {
  const Authority authority({"component", "subscriber", "robot:robot1"});
  const Authority foreign({"component", "subscriber", "robot:robot1"});
  const TestDomain domain;
  const auto plain = test_participant(domain);
  const auto strangers = secured(domain, foreign.of("robot1"));
  const auto foreign_bus = secured(domain, foreign.of("subscriber"));
  HealthWatch plain_health(plain), foreign_health(foreign_bus);
  using Objects = dds::Writer<pocd_msgs::msg::ObjectStatePubSubType>;
  const Objects plain_objects(plain, dds::topics::kObjects);
  const Objects foreign_objects(secured(domain, foreign.of("component")), dds::topics::kObjects);
  RobotSender plain_robot(plain, "robot1"), foreign_robot(strangers, "robot1");
  Process node(fleet_command(domain, {"--lossless", "--security", authority.of("component"),
                                      "--set", "node.segmentation=absent"}));
  const auto subscriber = secured(domain, authority.of("subscriber"));
  HealthWatch health(subscriber);
  dds::Wakeup wakeup;
  const dds::Reader<pocd_msgs::msg::ObjectStatePubSubType> objects(subscriber,
                                                                   dds::topics::kObjects, wakeup);
  RobotSender robot(secured(domain, authority.of("robot1")), "robot1");
  ASSERT_TRUE(eventually([&] { return health.newest() && robot.matched(); })) << node.err();
  StampNs stamp_ns = 0;
  // The others send all the while, and have been there for longer.
  EXPECT_TRUE(eventually([&] {
    stamp_ns += 33'000'000;
    for (RobotSender* sender : {&robot, &plain_robot, &foreign_robot}) sender->send_frame(stamp_ns);
    return health.newest()->frames_processed() >= 5;
  })) << node.err();
  EXPECT_EQ(plain_health.newest(), nullptr);
  EXPECT_EQ(foreign_health.newest(), nullptr);
  EXPECT_FALSE(plain_robot.depth.matched() > 0 || foreign_robot.depth.matched() > 0);
  EXPECT_EQ(objects.matched(), 1) << "a subscriber takes objects from the component only";
  EXPECT_TRUE(health.newest()->problems().empty()) << health.newest()->problems()[0].reason();
  const CommandResult asked =
      run_command({bin("pocd_health"), "--domain", domain.text(), "--timeout", "2"});
  EXPECT_EQ(asked.exit_code, 1) << asked.out;
  const CommandResult allowed =
      run_command({bin("pocd_health"), "--domain", domain.text(), "--timeout", "60", "--security",
                   authority.of("subscriber")});
  EXPECT_EQ(allowed.exit_code, 0) << allowed.out;
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

// The own side refuses first, and names the topic.
TEST(Security, OutsideOfItsRoleAParticipantHasNoEndpoints) {
  const Authority authority({"subscriber", "robot:robot1"});
  const TestDomain domain;
  const auto robot = secured(domain, authority.of("robot1"));
  const auto subscriber = secured(domain, authority.of("subscriber"));
  dds::Wakeup wakeup;
  using Objects = dds::Writer<pocd_msgs::msg::ObjectStatePubSubType>;
  EXPECT_EQ(refusal([&] { Objects(robot, dds::topics::kObjects); }),
            "cannot create a writer of topic pocd/objects");
  EXPECT_NE(refusal([&] { RobotSender(robot, "robot2"); }), "") << "another robot's topics";
  EXPECT_NE(refusal([&] { HealthWatch watch(robot); }), "");
  EXPECT_NE(refusal([&] { RobotSender(subscriber, "robot1"); }), "");
  EXPECT_NE(refusal([&] {
              dds::Writer<pocd_msgs::msg::MapManifestPubSubType>(subscriber,
                                                                 dds::topics::kMapManifest);
            }),
            "");
  EXPECT_NE(refusal([&] {
              dds::Reader<sensor_msgs::msg::ImagePubSubType>(subscriber, dds::topics::kDepth,
                                                             "rt/robot1/depth/image_raw",
                                                             dds::topics::kDepth.delivery, wakeup);
            }),
            "")
      << "who may know objects may not look through the cameras";
}

// Fast DDS 2.9.1 loses one of two who are discovered by two threads at the same time.
TEST(Security, WhoComesAtTheSameTimeAsOthersIsHeard) {
  if (sanitized()) GTEST_SKIP() << "nothing is loaded before a sanitizer";
  const Authority authority({"component", "subscriber"});
  const TestDomain domain;
  std::vector<std::unique_ptr<HealthWatch>> all;
  for (int i = 0; i < 6; ++i) {
    all.push_back(std::make_unique<HealthWatch>(secured(domain, authority.of("subscriber"))));
  }
  Process node(preloaded(POCD_SLOW_MATCHING,
                         fleet_command(domain, {"--security", authority.of("component")})));
  for (const auto& health : all) {
    EXPECT_TRUE(eventually([&] { return health->newest() != nullptr; })) << node.err();
  }
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

TEST(Security, WhatIsMissingIsNamed) {
  const Authority authority({"component"});
  std::filesystem::remove(authority.of("component") + "/permissions.p7s");
  const TestDomain domain;
  const CommandResult ended =
      run_command(node_command(domain, {"--security", authority.of("component")}));
  EXPECT_NE(ended.exit_code, 0);
  EXPECT_NE(ended.err.find("component/permissions.p7s: no such file (security)"), std::string::npos)
      << ended.err;
  // A certificate of another authority than the one that the folder names.
  const Authority foreign({"component"});
  std::filesystem::copy_file(foreign.of("component") + "/permissions.p7s",
                             authority.of("component") + "/permissions.p7s");
  std::filesystem::copy_file(foreign.of("component") + "/cert.pem",
                             authority.of("component") + "/cert.pem",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_NE(run_command(node_command(domain, {"--security", authority.of("component")})).exit_code,
            0);
  const CommandResult role =
      run_command({source("launch_scripts/security/make_ca.sh"), authority.of("other"), "admiral"});
  EXPECT_EQ(role.exit_code, 2);
  EXPECT_NE(role.err.find("no role \"admiral\"; there are: component operator robot subscriber"),
            std::string::npos)
      << role.err;
}

}  // namespace
}  // namespace pocd
