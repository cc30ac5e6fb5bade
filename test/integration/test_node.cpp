// pocd_node as a process: start, end, what it says about bad input.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <sstream>

#include "robot_sender.hpp"

namespace pocd {
namespace {

TEST(Node, EndsInOrderOnEverySignal) {
  std::signal(SIGHUP, SIG_DFL);  // below nohup it is ignored, by the node as well
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    const TestDomain domain;
    HealthWatch health(test_participant(domain));
    Process node(node_command(domain));
    ASSERT_TRUE(eventually([&] { return health.newest() != nullptr; }));
    EXPECT_EQ(health.newest()->message(), "running");
    node.signal(number);
    const CommandResult result = node.wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    // The last state was acknowledged before the end; this side may still have to look at it.
    EXPECT_TRUE(eventually([&] { return health.newest()->message() == "stopped"; }));
  }
}

TEST(Node, UsageErrorsNameWhatIsWrongAndExitCodeIs2) {
  const std::string config = source("config/simulated.yaml");
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"--config", config, "--set", "node.topics.depth=rt/depth"}, "rt/depth"},
      {{"--config", "missing.yaml", "--robot", "r"}, "missing.yaml"},
      // With the key that was likely meant.
      {{"--config", config, "--robot", "r", "--set", "node.queue_framez=3"},
       "did you mean queue_frames?"},
      {{"--config", config, "--robot", "r", "--set", "node.queue_frames=0"},
       "queue_frames: 0 is out of range"},
      {{"--config", config, "--robot", "r", "--robot", "r"}, "the name r is used twice"},
      {{"--config", config, "--robot", "r 1"}, "\"r 1\" has a blank"},
      {{"--config", config, "--set", "node.topics.odometry=rt/{robot}/o dom"}, "has a blank in it"},
      {{"--config", config, "--robot", "r", "--domain", "500"}, "--domain"},
      {{"--nonsense"}, "--nonsense"}};
  for (auto [arguments, named] : cases) {
    arguments.insert(arguments.begin(), bin("pocd_node"));
    const CommandResult result = run_command(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.back() << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << named << " in: " << result.err;
    EXPECT_EQ(result.out, "") << arguments.back();
  }
}

TEST(Node, AllThatIsWrongWithNamedRobotsIsSaid) {
  const CommandResult result = run_command({bin("pocd_node"), "--robot", "r 1", "--robot", "r 1"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("node: robots: the name \"r 1\" has a blank in it"), std::string::npos)
      << result.err;
  EXPECT_NE(result.err.find("node: robots: the name r 1 is used twice"), std::string::npos)
      << result.err;
}

TEST(Node, ARobotOfTheCommandLineKeepsItsEntryInTheFile) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "robots.yaml";
  const auto dump = [&](const std::string& entry) {
    std::ofstream(file) << "node:\n  robots:\n    - {name: robot1, " << entry << "}\n";
    return run_command({bin("pocd_node"), "--config", file.string(), "--robot", "robot1", "--robot",
                        "robot2", "--dump"});
  };
  const CommandResult kept = dump("depth_topic: rt/front/depth, mount: {given: true, x_m: 0.3}");
  EXPECT_EQ(kept.exit_code, 0) << kept.err;
  EXPECT_NE(kept.out.find("rt/front/depth"), std::string::npos) << kept.out;
  EXPECT_NE(kept.out.find("robot2"), std::string::npos) << kept.out;
  const CommandResult unused = dump("mount: {x_m: 0.3}");
  EXPECT_EQ(unused.exit_code, 2) << "a mount that would not be used";
  EXPECT_NE(unused.err.find("given is false"), std::string::npos) << unused.err;
  EXPECT_EQ(dump("color_topic: rt/front/color").exit_code, 2) << "colour is absent";
}

TEST(Commands, HelpShowsAnExample) {
  for (const char* command :
       {"pocd_node", "pocd_play", "pocd_mirror", "pocd_health", "pocd_doctor"}) {
    const CommandResult result = run_command({bin(command), "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("Example"), std::string::npos) << command;
    EXPECT_NE(result.out.find(std::string(command) + " --"), std::string::npos) << command;
  }
}

TEST(Health, FreshNodeIsUpAndSaysWhatItWaitsFor) {
  const TestDomain domain;
  const auto ask = [&](const std::string& name, const std::string& timeout) {
    return run_command(
        {bin("pocd_health"), "--domain", domain.text(), "--name", name, "--timeout", timeout});
  };
  Process node(node_command(domain, {"--name", "north_hall"}));
  const CommandResult up = ask("north_hall", "60");
  EXPECT_EQ(up.exit_code, 0) << up.out;
  EXPECT_EQ(up.out,
            "north_hall is up: running, robot1: waiting for its first frame, 0 frames processed, 0 "
            "dropped, 0 objects, map version 0\n");
  const CommandResult other = ask("south_hall", "0.5");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.out.find("south_hall was not heard on domain"), std::string::npos) << other.out;
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
  EXPECT_EQ(ask("north_hall", "0.5").exit_code, 1);
}

TEST(Node, CountsBadInputByReasonAndStaysUp) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender sender(bus, "robot1", true);
  // Reliable readers, so that what is counted does not depend on luck.
  Process node(node_command(domain, {"--lossless"}));
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr && sender.matched(); }));

  StampNs stamp_ns = 1'000'000'000;
  const auto bad_image = [&](auto& writer, auto change) {
    auto message = sender.image(stamp_ns += 1'000'000);
    change(message);
    EXPECT_TRUE(writer.write(message));
  };
  using Image = sensor_msgs::msg::Image;
  bad_image(sender.depth, [](Image& m) { m.encoding("mono7"); });
  bad_image(sender.depth, [](Image& m) { m.encoding("mono7"); });
  bad_image(sender.depth, [](Image& m) { m.data().resize(100); });
  bad_image(sender.depth, [](Image& m) { m.step(3); });
  bad_image(sender.depth, [](Image& m) { m.width(0); });
  bad_image(*sender.labels, [](Image& m) { m.encoding("jpeg"); });

  auto info = dds::camera_message({30, 20, 0, 40, 15, 10}, stamp_ns, "camera");
  sender.info.write(info);
  const auto bad_pose = [&](auto change) {
    auto message = dds::odometry_message({"map", "base", stamp_ns += 1'000'000, PoseQuaternion{}});
    change(message);
    EXPECT_TRUE(sender.odometry.write(message));
  };
  using Odometry = nav_msgs::msg::Odometry;
  bad_pose([](Odometry& m) { m.pose().pose().position().x(std::nan("")); });
  bad_pose([](Odometry& m) { m.pose().pose().orientation().w(0.5); });
  bad_pose([](Odometry&) {});
  bad_pose([](Odometry& m) { m.header().stamp().sec(0); });

  auto good = sender.image(stamp_ns += 1'000'000);
  sender.depth.write(good);
  auto again = sender.image(stamp_ns - 5'000'000);
  sender.depth.write(again);

  const std::string depth = "rt/robot1/depth/image_raw", odometry = "rt/robot1/odom";
  EXPECT_TRUE(eventually([&] { return health.problem(depth, "stamp_backwards") == 1; }));
  EXPECT_TRUE(eventually([&] { return health.problem(odometry, "stamp_backwards") == 1; }));
  EXPECT_EQ(health.problem(depth, "unknown_encoding"), 2u);
  EXPECT_EQ(health.problem(depth, "data_size"), 1u);
  EXPECT_EQ(health.problem(depth, "step_too_small"), 1u);
  EXPECT_EQ(health.problem(depth, "empty_image"), 1u);
  EXPECT_EQ(health.problem("rt/robot1/segmentation", "unknown_encoding"), 1u);
  EXPECT_EQ(health.problem("rt/robot1/depth/camera_info", "zero_focal_length"), 1u);
  EXPECT_EQ(health.problem(odometry, "not_finite"), 1u);
  EXPECT_EQ(health.problem(odometry, "non_unit_quaternion"), 1u);
  EXPECT_EQ(health.newest()->level(), 1) << "a warning";
  // The good image lacks its camera info, and the node says so.
  EXPECT_TRUE(eventually([&] {
    return !health.newest()->robots().empty() &&
           health.newest()->robots()[0].waiting_for().find("waiting for camera_info") == 0;
  }));

  node.signal(SIGTERM);
  const CommandResult result = node.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(count_of(result.err, "unknown_encoding: encoding \"mono7\""), 1u)
      << "two bad images are logged once";
}

// A camera driver may announce a segmentation topic that nothing is ever sent on, or none. That the
// poses come long after the images costs no frame.
TEST(Node, OptionalStreamThatStaysSilentDoesNotHoldALosslessRun) {
  for (const bool announced : {true, false}) {
    const TestDomain domain;
    const auto bus = test_participant(domain);
    HealthWatch health(bus);
    RobotSender sender(bus, "robot1", announced);
    Process node(node_command(domain, {"--lossless", "--set", "node.silent_wait_s=1"}));
    ASSERT_TRUE(eventually([&] { return health.newest() != nullptr && sender.matched(); }));
    constexpr int kFrames = 60, kPosesBehind = 20;
    const auto send_pose = [&](int i) {
      sender.send_odometry({"map", sender.camera_frame(), i * StampNs{33'000'000}, {}});
    };
    for (int i = 1; i <= kFrames; ++i) {
      sender.send_image(i * StampNs{33'000'000});
      if (i > kPosesBehind) send_pose(i - kPosesBehind);
    }
    for (int i = kFrames - kPosesBehind + 1; i <= kFrames; ++i) send_pose(i);
    // What nobody announces is still waited for through the last 0.3 s of data time.
    const int at_once = announced ? kFrames : kFrames - 10;
    EXPECT_TRUE(eventually([&] {
      return static_cast<int>(health.newest()->frames_processed()) >= at_once;
    })) << announced
        << ": " << health.newest()->frames_processed() << " processed, "
        << health.newest()->robots()[0].waiting_for();
    EXPECT_TRUE(sender.odometry.wait_acknowledged(kGenerous));
    node.signal(SIGTERM);
    const CommandResult result = node.wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("60 frames processed"), std::string::npos) << result.err;
  }
}

// Its synchroniser and its reader are full of images that wait for labels. What was acknowledged is
// used or counted.
TEST(Node, TheEndOfALosslessRunTakesAllThatHasArrived) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender sender(bus, "robot1", true);
  Process node(node_command(domain, {"--lossless", "--set", "node.segmentation=required", "--set",
                                     "node.silent_wait_s=3600"}));
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr && sender.matched(); }));
  constexpr int kHeld = 32 + 8;
  for (int i = 1; i <= kHeld; ++i) {
    const StampNs stamp_ns = i * StampNs{33'000'000};
    sender.send_odometry({"map", sender.camera_frame(), stamp_ns, {}});
    sender.send_image(stamp_ns);
  }
  ASSERT_TRUE(sender.depth.wait_acknowledged(kGenerous));
  ASSERT_TRUE(sender.odometry.wait_acknowledged(kGenerous));
  ASSERT_TRUE(sender.info.wait_acknowledged(kGenerous));
  node.signal(SIGTERM);
  ASSERT_TRUE(eventually([&] { return health.newest()->message() == "stopped"; }));
  ASSERT_EQ(health.newest()->robots().size(), 1u);
  EXPECT_EQ(health.newest()->robots()[0].dropped(), static_cast<std::uint64_t>(kHeld));
  EXPECT_EQ(node.wait().exit_code, 0);
}

// What is queued at the end may take long: the node stays heard, and its map goes on.
TEST(Node, IsHeardWhileItEmptiesItsQueue) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::NodeHealthPubSubType> reader(bus, dds::topics::kHealth, wakeup);
  RobotSender sender(bus, "robot1");
  Process node(
      node_command(domain, {"--lossless", "--set", "node.queue_frames=3000", "--set",
                            "node.segmentation=absent", "--set", "map.voxel_size_m=0.02"}));
  ASSERT_TRUE(eventually([&] { return sender.matched(); }));
  std::vector<pocd_msgs::msg::NodeHealth> heard;
  const auto hear = [&] {
    pocd_msgs::msg::NodeHealth health;
    dds::SampleMeta meta;
    const std::size_t before = heard.size();
    while (reader.take(health, meta)) {
      if (meta.valid) heard.push_back(health);
    }
    return heard.size() > before;
  };
  StampNs stamp_ns = 0;
  const auto send = [&] {
    stamp_ns += 33'000'000;
    sender.send_odometry({"map", "camera", stamp_ns, {}});
    auto info = dds::camera_message({640, 480, 400, 400, 320, 240}, stamp_ns, "camera");
    EXPECT_TRUE(sender.info.write(info));
    auto depth = dds::image_message(cv::Mat(480, 640, CV_16UC1, cv::Scalar(1500)), "16UC1",
                                    stamp_ns, "camera");
    EXPECT_TRUE(sender.depth.write(depth));
  };
  ASSERT_TRUE(eventually([&] {  // work for six seconds
    if (!hear()) return false;
    const auto& now = heard.back();
    if (now.queue_length() * now.processing_ms() > 6000.0) return true;
    // Faster than they are processed: not one by one, and fewer than the writer keeps. Not many
    // more than that work either: where a frame takes seconds, a hundred are too many to wait for.
    if (now.processing_ms() <= 0.0 && now.queue_length() >= 5) return false;
    const double wanted = now.processing_ms() > 0.0 ? 7000.0 / now.processing_ms() : 10.0;
    for (int i = 0; i < std::clamp(static_cast<int>(wanted), 2, 100); ++i) send();
    EXPECT_TRUE(sender.depth.wait_acknowledged(kGenerous));
    return false;
  }));
  const std::size_t before = heard.size();
  node.signal(SIGTERM);
  EXPECT_TRUE(eventually([&] { return hear() && heard.back().message() == "stopped"; }));
  EXPECT_EQ(node.wait().exit_code, 0);
  // One may have been on its way when the signal came.
  ASSERT_GE(heard.size(), before + 3) << "only its last word";
  EXPECT_EQ(heard[before + 1].message(), "running");
}

TEST(Commands, SayAsMuchAsIsWantedAndAsJsonLines) {
  const TestDomain domain;
  const auto said = [&](const std::vector<std::string>& more) {
    auto command =
        std::vector<std::string>{bin("pocd_mirror"), "--timeout", "0.5", "--domain", domain.text()};
    command.insert(command.end(), more.begin(), more.end());
    return run_command(command).err;
  };
  EXPECT_NE(said({}).find("pocd_mirror: info: stale, because no publisher"), std::string::npos);
  const std::string little = said({"--log-level", "error"});
  EXPECT_EQ(little.find("info"), std::string::npos) << little;
  EXPECT_NE(little.find("pocd_mirror: error: gave up after 0.5 s"), std::string::npos) << little;
  EXPECT_EQ(said({"--log-level", "off"}), "");
  std::istringstream lines(said({"--log-json"}));
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_EQ(line.rfind("{\"time\":\"2", 0), 0u) << line;
    EXPECT_NE(line.find("Z\",\"level\":\""), std::string::npos) << line;
    EXPECT_NE(line.find("\"program\":\"pocd_mirror\",\"message\":\""), std::string::npos) << line;
    EXPECT_EQ(line.substr(line.size() - 2), "\"}") << line;
  }
  EXPECT_GE(count, 2);
  const CommandResult wrong = run_command({bin("pocd_mirror"), "--log-level", "loud"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("--log-level"), std::string::npos) << wrong.err;
}

TEST(Node, OperatorsProfileReplacesTheTable) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto file = folder.path() / "profiles.xml";
  std::ofstream(file) << R"(<?xml version="1.0" encoding="UTF-8" ?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <data_writer profile_name="pocd/health"><qos><reliability><kind>BEST_EFFORT</kind></reliability>
  </qos></data_writer></profiles>)";
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::NodeHealthPubSubType> reader(bus, dds::topics::kHealth, wakeup);
  Process node(node_command(domain, {"--profiles", file.string()}));
  // A reliable reader does not match the best-effort writer that the profile asks for.
  EXPECT_TRUE(eventually([&] { return reader.incompatible() > 0; }));
  EXPECT_EQ(reader.matched(), 0);
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
  std::ofstream(file) << "<profiles><nonsense/></profiles>";
  EXPECT_NE(run_command(node_command(domain, {"--profiles", file.string()})).exit_code, 0);
}

}  // namespace
}  // namespace pocd
