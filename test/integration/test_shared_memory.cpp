// Shared memory of processes that are killed, ports that are made anew, and a /dev/shm that is too
// small. Each test has a /dev/shm of its own.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <fastdds/rtps/transport/TransportInterface.h>
#include <array>
#include <atomic>
#include <cstdlib>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/rtps/common/LocatorList.hpp>
#include <iostream>
#include <set>
#include <thread>

#include "bus_harness.hpp"
#include "pocd_dds/entities/port_files.hpp"
#include "pocd_dds/entities/shared_memory.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/object_watch.hpp"

namespace pocd {
namespace {

using Manifests = dds::Writer<pocd_msgs::msg::MapManifestPubSubType>;
using ManifestReader = dds::Reader<pocd_msgs::msg::MapManifestPubSubType>;

/// This process and all it starts from here on has shared memory of its own. Says what is missing
/// to make it.
const std::string& own_shared_memory() {
  static const std::string problem = [] {
    const bool made = unshare(CLONE_NEWNS) == 0 &&
                      mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                      mount("tmpfs", "/dev/shm", "tmpfs", 0, "size=1g") == 0;
    return std::string(made ? "" : "no right to mount a /dev/shm");
  }();
  return problem;
}

/// Takes one sample and never comes back, as a receiver that is busy for the moment.
class Busy : public eprosima::fastdds::dds::DataReaderListener {
  void on_data_available(eprosima::fastdds::dds::DataReader*) override {
    std::cout << "is busy" << std::endl;
    for (;;) pause();
  }
};

void write(Manifests& manifests) {
  pocd_msgs::msg::MapManifest manifest;
  manifests.write(manifest);
}

/// Is held up by its first sample until it is released, and counts them all.
class HeldUp : public eprosima::fastdds::dds::DataReaderListener {
 public:
  std::atomic<bool> released{false};
  std::atomic<int> heard{0};

 private:
  void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
    pocd_msgs::msg::MapManifest manifest;
    eprosima::fastdds::dds::SampleInfo info;
    while (reader->take_next_sample(&manifest, &info) ==
           eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      ++heard;
      while (!released) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
};

/// What a test starts as a process of its own: a part of this program, by name.
std::vector<std::string> part(const std::string& name) {
  return {"/proc/self/exe", "--gtest_also_run_disabled_tests",
          "--gtest_filter=DISABLED_Process." + name};
}
TEST(DISABLED_Process, IsBusyWithAManifest) {
  dds::Participant participant({dds::default_domain(), "", "busy"});
  const dds::TopicSpec& spec = dds::topics::kMapManifest;
  const auto topic = participant.topic(
      spec.name, eprosima::fastdds::dds::TypeSupport(new pocd_msgs::msg::MapManifestPubSubType));
  Busy busy;
  participant.subscriber()->create_datareader(
      topic.get(), participant.reader_qos(spec.name, spec.delivery), &busy);
  for (;;) pause();
}
TEST(DISABLED_Process, HearsAManifest) {
  dds::Wakeup wakeup;
  ManifestReader reader(
      std::make_shared<dds::Participant>(dds::BusOptions{dds::default_domain(), "", "next"}),
      dds::topics::kMapManifest, wakeup);
  pocd_msgs::msg::MapManifest heard;
  dds::SampleMeta meta;
  EXPECT_TRUE(eventually([&] { return reader.take(heard, meta); }));
}

TEST(DISABLED_Process, WritesManifests) {
  Manifests manifests(
      std::make_shared<dds::Participant>(dds::BusOptions{dds::default_domain(), "", "writes"}),
      dds::topics::kMapManifest);
  for (;;) {
    if (manifests.matched() > 0) {
      write(manifests);
      std::cout << "written" << std::endl;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// Of the first participant of a host; each has two, the second for what is no discovery.
std::uint32_t first_port(const TestDomain& domain) {  // RTPS 2.2, 9.6.1.1
  return static_cast<std::uint32_t>(7400 + 250 * domain.number() + 10);
}

/// How many ports this process has open whose files are deleted.
std::size_t deleted_ports() {
  const std::string maps = read_text("/proc/self/maps");
  std::size_t count = 0;
  for (auto at = maps.find("fastrtps_port"); at != std::string::npos;
       at = maps.find("fastrtps_port", at + 1)) {
    const std::string line = maps.substr(at, maps.find('\n', at) - at);
    count += line.find("(deleted)") != std::string::npos;
  }
  return count;
}

TEST(SharedMemory, WhoTakesThePortOfAKilledReceiverIsHeard) {
  if (!own_shared_memory().empty()) GTEST_SKIP() << own_shared_memory();
  const TestDomain domain;
  setenv("ROS_DOMAIN_ID", domain.text().c_str(), 1);
  // The one that lives: as a node to its subscribers, or a player to its node.
  const auto sender = test_participant(domain);
  Manifests manifests(sender, dds::topics::kMapManifest);
  {
    Process busy(part("IsBusyWithAManifest"));
    ASSERT_TRUE(eventually([&] { return manifests.matched() == 1; }));
    write(manifests);
    ASSERT_TRUE(eventually([&] { return count_of(busy.out(), "is busy") == 1; })) << busy.err();
    // Killed here.
  }
  Process next(part("HearsAManifest"));
  // What this process has open to send to the one that was killed.
  ASSERT_TRUE(eventually([&] { return deleted_ports() > 0; })) << "it has taken another port";
  EXPECT_TRUE(eventually([&] {
    write(manifests);
    return !next.running();
  }));
  EXPECT_EQ(next.wait().exit_code, 0);
}

/// Segments that participants of this host send from.
std::set<std::string> segments() {
  std::set<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
    const std::string name = file.path().filename().string();
    const bool of_a_port = name.find("_port") != std::string::npos;
    if (name.find("fastrtps_") == 0 && name.find("_el") == std::string::npos && !of_a_port)
      names.insert(name);
  }
  return names;
}

// What a killed sender has said last is still in the port when its memory has been given up.
TEST(SharedMemory, AReceiverThatWasHeldUpWhenASenderWasKilledHearsOthers) {
  if (!own_shared_memory().empty()) GTEST_SKIP() << own_shared_memory();
  const TestDomain domain;
  setenv("ROS_DOMAIN_ID", domain.text().c_str(), 1);
  const auto receiver = test_participant(domain);
  const dds::TopicSpec& spec = dds::topics::kMapManifest;
  const auto topic = receiver->topic(
      spec.name, eprosima::fastdds::dds::TypeSupport(new pocd_msgs::msg::MapManifestPubSubType));
  HeldUp held_up;
  auto* const reader = receiver->subscriber()->create_datareader(
      topic.get(), receiver->reader_qos(spec.name, spec.delivery), &held_up);
  const std::set<std::string> before = segments();
  {
    Process sender(part("WritesManifests"));
    ASSERT_TRUE(eventually([&] { return held_up.heard == 1; })) << sender.err();
    const std::size_t written = count_of(sender.out(), "written");
    ASSERT_TRUE(eventually([&] { return count_of(sender.out(), "written") > written + 5; }));
    EXPECT_GT(segments().size(), before.size());
    // Killed here.
  }
  EXPECT_TRUE(eventually([&] { return segments() == before; }));
  held_up.released = true;
  Process next(part("WritesManifests"));
  EXPECT_TRUE(eventually([&] { return held_up.heard > 50; })) << next.err();
  receiver->subscriber()->delete_datareader(reader);
}

namespace rtps = eprosima::fastdds::rtps;

/// Sends to a port of this host from a segment of its own.
class PortSender {
 public:
  explicit PortSender(std::uint32_t port) {
    rtps::Locator locator(LOCATOR_KIND_SHM, port);
    to_.push_back(locator);
    EXPECT_TRUE(transport_->init() && transport_->OpenOutputChannel(way_, locator));
  }
  bool send() {
    rtps::Locators begin(to_.begin()), end(to_.end());
    const std::array<eprosima::fastrtps::rtps::octet, 16> data{};
    return way_.front()->send(data.data(), data.size(), &begin, &end,
                              std::chrono::steady_clock::now() + std::chrono::seconds(1));
  }

 private:
  std::unique_ptr<rtps::TransportInterface> transport_{
      rtps::SharedMemTransportDescriptor().create_transport()};
  rtps::SendResourceList way_;
  rtps::LocatorList to_;
};

class Counts : public rtps::TransportReceiverInterface {
 public:
  std::atomic<int> heard{0};

 private:
  void OnDataReceived(const eprosima::fastrtps::rtps::octet*, std::uint32_t, const rtps::Locator&,
                      const rtps::Locator&) override {
    ++heard;
  }
};

// A process that starts while another one ends: nothing was ever received before.
TEST(SharedMemory, AReceiverWhoseFirstMessageIsOfOneThatHasGoneHearsOthers) {
  if (!own_shared_memory().empty()) GTEST_SKIP() << own_shared_memory();
  constexpr std::uint32_t kPort = 7421;
  Counts received;
  const std::unique_ptr<rtps::TransportInterface> receiver(
      dds::LastingSharedMemory(rtps::SharedMemTransportDescriptor()).create_transport());
  ASSERT_TRUE(receiver->init());
  const rtps::Locator port(LOCATOR_KIND_SHM, kPort);
  ASSERT_TRUE(receiver->OpenInputChannel(port, &received, 65500));
  const std::set<std::string> before = segments();
  PortSender gone(kPort);
  for (const std::string& name : segments()) {
    if (before.count(name) == 0) std::filesystem::remove("/dev/shm/" + name);
  }
  ASSERT_EQ(segments(), before);
  ASSERT_TRUE(gone.send());
  PortSender next(kPort);
  EXPECT_TRUE(eventually([&] { return next.send() && received.heard > 0; }));
  receiver->CloseInputChannel(port);
  receiver->shutdown();
}

TEST(SharedMemory, AReceiverWhosePortWasMadeAnewByOthersListensThere) {
  if (!own_shared_memory().empty()) GTEST_SKIP() << own_shared_memory();
  const TestDomain domain;
  ObjectWatchOptions options;
  options.domain = domain.number();
  const ObjectWatch watch(options);
  // As a killed process's are: by whoever takes its port next.
  int removed = 0;
  for (std::uint32_t port = first_port(domain); port < first_port(domain) + 20; ++port) {
    const bool own = dds::has_port_file(port, dds::port_file_id(port));
    removed += own && std::filesystem::remove(dds::port_file(port));
  }
  ASSERT_EQ(removed, 2);
  Process node(node_command(domain));
  EXPECT_TRUE(eventually([&] { return watch.publisher_present(); })) << node.err();
}

/// The node with so much of shared memory for it and what else the command starts.
std::vector<std::string> with_room(const std::string& size, const std::string& script,
                                   const TestDomain& domain) {
  std::vector<std::string> command{
      "/usr/bin/unshare",
      "--mount",
      "/bin/bash",
      "-c",
      "mount -t tmpfs -o size=" + size + " small /dev/shm && " + script,
      "-"};
  for (const std::string& word : node_command(domain)) command.push_back(word);
  return command;
}

TEST(SharedMemory, ATooSmallOneIsNotUsedAndNobodyDies) {
  if (!own_shared_memory().empty()) GTEST_SKIP() << own_shared_memory();
  const TestDomain domain;
  Process node(with_room("24m", "exec \"$@\"", domain));
  const CommandResult health =
      run_command({bin("pocd_health"), "--ready", "--timeout", "60", "--domain", domain.text()});
  EXPECT_EQ(health.exit_code, 0) << health.out << health.err;
  node.signal(SIGINT);
  const CommandResult ended = node.wait();
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_EQ(count_of(ended.err, "/dev/shm has 24 MiB free, shared memory needs 33 MiB"), 1u)
      << ended.err;
}

TEST(SharedMemory, RoomForOneIsNotTakenByTwoThatStartAtOnce) {
  if (!own_shared_memory().empty()) GTEST_SKIP() << own_shared_memory();
  const TestDomain domain;
  Process nodes(with_room("40m",
                          "for i in 1 2 3 4; do \"$@\" --set node.map_id=$i & done; "
                          "trap 'kill -INT $(jobs -p)' INT; code=0; "
                          "for job in $(jobs -p); do "
                          "while kill -0 $job 2>/dev/null; do wait $job; last=$?; done; "
                          "[ $last = 0 ] || code=$last; done; exit $code",
                          domain));
  EXPECT_TRUE(eventually(
      [&] { return count_of(nodes.err(), "running on domain") == 4 || !nodes.running(); }));
  nodes.signal(SIGINT);
  const CommandResult ended = nodes.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(count_of(ended.err, "free, shared memory needs 33 MiB"), 3u) << ended.err;
}

}  // namespace
}  // namespace pocd
