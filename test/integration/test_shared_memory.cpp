// Shared memory of processes that are killed, ports that are made anew, and a /dev/shm that is too
// small. Each test has a /dev/shm of its own.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <iostream>

#include "bus_harness.hpp"
#include "pocd_dds/entities/port_files.hpp"
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

void write(Manifests& manifests) {
  pocd_msgs::msg::MapManifest manifest;
  manifests.write(manifest);
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
