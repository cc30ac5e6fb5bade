// What a node says about itself when a part of it cannot go on, and afterwards.
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstdlib>
#include <cstring>

#include "full_writers.hpp"
#include "preloaded.hpp"
#include "robot_sender.hpp"

namespace pocd {
namespace {

std::vector<std::string> quick_command(const TestDomain& domain,
                                       const std::vector<std::string>& more = {}) {
  auto command = fleet_command(domain, {"--set", "node.segmentation=absent", "--set",
                                        "node.health_window_s=2", "--set", "node.stall_s=1"});
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

/// The thread of a process that has this name; 0 when there is none.
pid_t thread_named(pid_t process, const std::string& name) {
  const auto tasks = "/proc/" + std::to_string(process) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    if (read_text(task.path() / "comm") == name + "\n") {
      return static_cast<pid_t>(std::stol(task.path().filename().string()));
    }
  }
  return 0;
}

/// Holds one thread of a process of this test as long as it lives.
class HeldThread {
 public:
  explicit HeldThread(pid_t thread) : thread_(thread) {
    held_ = ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) == 0 &&
            ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0 &&
            waitpid(thread_, nullptr, __WALL) == thread_;
  }
  ~HeldThread() {
    if (held_) ptrace(PTRACE_DETACH, thread_, nullptr, nullptr);
  }
  HeldThread(const HeldThread&) = delete;
  HeldThread& operator=(const HeldThread&) = delete;
  bool held() const { return held_; }

 private:
  const pid_t thread_;
  bool held_ = false;
};

// One refused write was the end of a container: its health check failed for ever.
TEST(Health, RecoversFromRefusedWrites) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto profiles = folder.path() / "profiles.xml";
  write_one_sample_profiles(profiles, {dds::topics::kFrames.name});
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender robot(bus, "robot1");
  dds::Wakeup wakeup;
  dds::Reader<pocd_msgs::msg::FrameRecordPubSubType> full(
      bus, dds::topics::kFrames, dds::topics::kFrames.name, kRoomForOne, wakeup);
  Process node(quick_command(domain, {"--profiles", profiles.string()}));
  ASSERT_TRUE(eventually([&] { return health.newest() && robot.matched() && full.matched() > 0; }));
  EXPECT_TRUE(health.newest()->ready());
  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 33'000'000);
    return health.newest()->level() == 2;
  }));
  EXPECT_EQ(health.newest()->message(), "samples could not be written");
  const CommandResult failing = run_command({bin("pocd_health"), "--domain", domain.text()});
  EXPECT_EQ(failing.exit_code, 1) << failing.out;

  EXPECT_TRUE(eventually([&] { return health.newest()->level() == 0; }));
  EXPECT_EQ(health.newest()->message(), "running");
  const CommandResult well =
      run_command({bin("pocd_health"), "--ready", "--domain", domain.text()});
  EXPECT_EQ(well.exit_code, 0) << well.out;
  // What it still holds back for this reader is not acknowledged at the end: make room.
  pocd_msgs::msg::FrameRecord record;
  dds::SampleMeta meta;
  node.signal(SIGTERM);
  EXPECT_TRUE(eventually([&] {
    full.take(record, meta);
    return !node.running();
  }));
  EXPECT_EQ(node.wait().exit_code, 0) << "what failed long ago does not make it fail";
}

// A worker that hangs in a frame used to say "running" for ever.
TEST(Health, AThreadThatHangsIsSaidAndWhatIsSaidRecovers) {
  const TestDomain domain;
  HealthWatch health(test_participant(domain));
  Process node(quick_command(domain));
  ASSERT_TRUE(eventually([&] { return health.newest() && health.newest()->level() == 0; }));
  for (const auto& [thread, name] :
       std::vector<std::pair<std::string, std::string>>{{"pocd_worker", "the pipeline"},
                                                        {"pocd_intake", "the intake"},
                                                        {"pocd_teller", "the writer of objects"}}) {
    const pid_t id = thread_named(node.pid(), thread);
    ASSERT_GT(id, 0) << thread;
    {
      const HeldThread held(id);
      if (!held.held()) GTEST_SKIP() << "threads may not be traced here";
      EXPECT_TRUE(eventually([&] { return health.newest()->level() == 2; }));
      EXPECT_EQ(health.newest()->message().rfind(name + " has not ended a turn for ", 0), 0u)
          << health.newest()->message();
      EXPECT_FALSE(health.newest()->ready());
      EXPECT_GE(health.newest()->still_s(), 1.0);
    }
    EXPECT_TRUE(eventually([&] { return health.newest()->level() == 0; }));
    EXPECT_TRUE(health.newest()->ready());
  }
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

// Subscribers of objects are no reason for the pipeline, the map or the status to wait.
TEST(Node, ASubscriberOfObjectsHoldsUpNothingElse) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto profiles = folder.path() / "profiles.xml";
  constexpr int kForEver = 100000;
  write_one_sample_profiles(profiles, {dds::topics::kFrames.name}, kForEver);
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender robot(bus, "robot1");
  dds::Wakeup wakeup;
  auto full = std::make_unique<dds::Reader<pocd_msgs::msg::FrameRecordPubSubType>>(
      bus, dds::topics::kFrames, dds::topics::kFrames.name, kRoomForOne, wakeup);
  Process node(quick_command(domain, {"--profiles", profiles.string()}));
  ASSERT_TRUE(
      eventually([&] { return health.newest() && robot.matched() && full->matched() > 0; }));
  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 33'000'000);
    return health.newest()->frames_processed() > 20 && health.newest()->level() == 2;
  })) << health.newest()->frames_processed();
  EXPECT_EQ(health.newest()->message().rfind("the writer of objects has not ended", 0), 0u)
      << health.newest()->message();
  full.reset();
  EXPECT_TRUE(eventually([&] { return health.newest()->level() == 0; }))
      << health.newest()->message();
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

/// The socket that systemd gives a service.
class NoticeSocket {
 public:
  NoticeSocket() {
    path_ = (folder_.path() / "notify").string();
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~NoticeSocket() {
    ::unsetenv("NOTIFY_SOCKET");
    close(socket_);
  }
  NoticeSocket(const NoticeSocket&) = delete;
  NoticeSocket& operator=(const NoticeSocket&) = delete;

  /// What has come since the last call.
  std::string take() {
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(n)).append("\n");
    }
    return text;
  }

 private:
  TemporaryFolder folder_;
  std::string path_;
  int socket_ = -1;
};

TEST(Health, SystemdHearsThatItIsReadyAndAlive) {
  NoticeSocket notices;
  const TestDomain domain;
  Process node(quick_command(domain));
  std::string said;
  EXPECT_TRUE(eventually([&] {
    said += notices.take();
    return count_of(said, "WATCHDOG=1") >= 2;
  })) << said;
  EXPECT_EQ(count_of(said, "READY=1"), 1u) << said;
  EXPECT_NE(said.find("STATUS=running"), std::string::npos) << said;
  {
    const HeldThread held(thread_named(node.pid(), "pocd_worker"));
    if (!held.held()) GTEST_SKIP() << "threads may not be traced here";
    EXPECT_TRUE(eventually([&] {
      said = notices.take();
      return said.find("STATUS=the pipeline has not ended a turn") != std::string::npos;
    }));
    notices.take();
    EXPECT_TRUE(eventually([&] {
      said += notices.take();
      return count_of(said, "has not ended a turn") >= 3;
    }));
    EXPECT_EQ(count_of(said, "WATCHDOG=1"), 0u) << said;
  }
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
  said = notices.take();
  EXPECT_NE(said.find("STOPPING=1"), std::string::npos) << said;
  EXPECT_EQ(count_of(said, "READY=1"), 0u) << "once";
}

// Fast DDS 2.9.1 can deadlock its discovery for good. Nobody noticed: the node processed nothing.
TEST(Health, DiscoveryThatHangsIsSaidAndWhatIsSaidRecovers) {
  if (sanitized()) GTEST_SKIP() << "a sanitizer has to be loaded first";
  NoticeSocket notices;
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto hang = folder.path() / "hang", socket = folder.path() / "health";
  HealthWatch health(test_participant(domain));
  Process node(with_hung_discovery(POCD_HUNG_DISCOVERY, hang,
                                   quick_command(domain, {"--health-socket", socket})));
  const auto ask = [&] {
    return run_command({bin("pocd_health"), "--ready", "--timeout", "1", "--socket", socket,
                        "--domain", domain.text()});
  };
  const auto says = [](const CommandResult& word) {
    return word.out.find("Fast DDS's discovery has not ended a turn for ") != std::string::npos;
  };
  ASSERT_TRUE(eventually([&] { return health.newest() && ask().exit_code == 0; }));
  std::ofstream(hang) << '\n';
  CommandResult word;
  EXPECT_TRUE(eventually([&] { return says(word = ask()); })) << word.out << node.err();
  EXPECT_EQ(word.exit_code, 1) << word.out;
  std::string said;
  notices.take();
  EXPECT_TRUE(eventually([&] {
    said += notices.take();
    return count_of(said, "STATUS=Fast DDS's discovery has not ended a turn") >= 3;
  })) << said;
  EXPECT_EQ(count_of(said, "WATCHDOG=1"), 0u) << said;
  EXPECT_TRUE(node.running());
  EXPECT_TRUE(
      eventually([&] { return node.err().find("start this process anew") != std::string::npos; }));

  std::filesystem::remove(hang);
  EXPECT_TRUE(eventually([&] { return ask().exit_code == 0; })) << ask().out;
  EXPECT_TRUE(eventually([&] { return node.err().find("goes on after") != std::string::npos; }));
  EXPECT_TRUE(eventually([&] { return health.newest()->level() == 0 && health.newest()->ready(); }))
      << "who had lost it has found it again";
  EXPECT_TRUE(eventually([&] { return notices.take().find("WATCHDOG=1") != std::string::npos; }));
  EXPECT_EQ(count_of(node.err(), "Fast DDS's discovery"), 2u) << node.err();
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

// A fleet manager has to hear it from its copy.
TEST(Health, ACopyInWhichDiscoveryHangsIsNotInStep) {
  if (sanitized()) GTEST_SKIP() << "a sanitizer has to be loaded first";
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto hang = folder.path() / "hang";
  Process node(quick_command(domain));
  Process mirror(with_hung_discovery(POCD_HUNG_DISCOVERY, hang,
                                     {bin("pocd_mirror"), "--domain", domain.text()}));
  const auto says = [&](const std::string& text) {
    return eventually([&] { return mirror.err().find(text) != std::string::npos; });
  };
  ASSERT_TRUE(says("in step with publisher")) << mirror.err();
  std::ofstream(hang) << '\n';
  EXPECT_TRUE(says("Fast DDS's discovery has not ended a turn for 1")) << mirror.err();
  EXPECT_TRUE(says("stale, because Fast DDS's discovery hangs: start this process anew"))
      << mirror.err();
  // A copy that hears nothing joins anew; the end of the participant that hangs would not return.
  const auto hung = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually(
      [&] { return std::chrono::steady_clock::now() - hung > std::chrono::seconds(15); }));
  EXPECT_EQ(count_of(mirror.err(), "joins the bus anew"), 0u) << mirror.err();
  EXPECT_TRUE(mirror.running());
  std::filesystem::remove(hang);
  EXPECT_TRUE(eventually([&] { return count_of(mirror.err(), "in step with publisher") >= 2; }))
      << mirror.err();
  mirror.signal(SIGTERM);
  EXPECT_EQ(mirror.wait().exit_code, 0);
  node.signal(SIGTERM);
  EXPECT_EQ(node.wait().exit_code, 0);
}

}  // namespace
}  // namespace pocd
