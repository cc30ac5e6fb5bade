// Eclipse Cyclone DDS as robot and as subscriber of one component, over UDP on the loopback
// interface only; and what a protocol analyser says about the packets.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "peer_log.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "udp_profiles.hpp"
#include "whole_run.hpp"

namespace pocd {
namespace {

std::string small_drives() { return source("test/peers/small_drives.yaml"); }

std::string dumpcap() {
  for (const char* path : {"/usr/bin/dumpcap", "/usr/local/bin/dumpcap"}) {
    if (::access(path, X_OK) == 0) return path;
  }
  return "";
}

/// One run for all tests below.
class Cyclone : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::filesystem::path folder = folder_->path();
    expected_ = offline_run(small_drives(), folder / "offline");
    DatasetOptions dataset;
    dataset.format = DatasetFormat::kSim;
    dataset.inputs = {small_drives()};
    dataset.with_color = false;
    PipelineConfig config;
    load_config(config, {source("config/simulated.yaml")});
    dataset.classes = config.classes;
    frames_ = write_frames(*open_dataset(dataset), folder / "frames");

    const TestDomain domain;
    std::unique_ptr<Process> capture = start_capture(domain, folder / "capture.pcapng");
    std::ofstream(folder / "udp.xml") << kUdpOnly;
    Process node(
        node_command(domain, {"--lossless", "--epoch", "77", "--profiles",
                              (folder / "udp.xml").string(), "--set", "node.outputs.twins_hz=20"}));
    Process peer({POCD_CYCLONE_PEER, domain.text(), (folder / "frames").string(),
                  (folder / "log").string()});
    const auto said = [&](const std::string& text) {
      return eventually([&] { return peer.err().find(text) != std::string::npos; });
    };
    const bool sent = said("sent " + std::to_string(frames_) + " frames");
    node.signal(SIGINT);
    const bool converged = sent && said("converged");
    ended_ = node.wait();
    peer.signal(SIGTERM);
    const CommandResult peer_ended = peer.wait();
    ASSERT_TRUE(converged) << "the peer said:\n" << peer_ended.err << ended_.err;
    ASSERT_EQ(peer_ended.exit_code, 0) << peer_ended.err;
    log_ = std::make_unique<PeerLog>(folder / "log");
    if (capture) {
      capture->signal(SIGINT);
      captured_ = capture->wait().exit_code == 0;
    }
  }
  static void TearDownTestSuite() { folder_.reset(); }

  void SetUp() override { ASSERT_NE(log_, nullptr) << "the run failed"; }

  /// Null, with the reason in no_capture_, where nothing may be captured.
  static std::unique_ptr<Process> start_capture(const TestDomain& domain,
                                                const std::filesystem::path& file) {
    if (dumpcap().empty()) {
      no_capture_ = "dumpcap is not installed";
      return nullptr;
    }
    const int first_port = 7400 + 250 * domain.number();  // RTPS 2.2, 9.6.1.1
    const std::string filter =
        "udp portrange " + std::to_string(first_port) + "-" + std::to_string(first_port + 249);
    auto process = std::make_unique<Process>(std::vector<std::string>{
        dumpcap(), "-q", "-i", "lo", "-B", "64", "-f", filter, "-w", file.string()});
    const auto started = [&] { return process->err().find("File: ") != std::string::npos; };
    eventually([&] { return started() || !process->running(); });
    if (process->running()) return process;
    no_capture_ = "no right to capture on lo: " + process->wait().err;
    return nullptr;
  }

  static std::unique_ptr<TemporaryFolder> folder_;
  static RunSummary expected_;
  static int frames_;
  static CommandResult ended_;
  static std::unique_ptr<PeerLog> log_;
  static std::string no_capture_;
  static bool captured_;
};

std::unique_ptr<TemporaryFolder> Cyclone::folder_ = std::make_unique<TemporaryFolder>();
RunSummary Cyclone::expected_;
int Cyclone::frames_ = 0;
CommandResult Cyclone::ended_;
std::unique_ptr<PeerLog> Cyclone::log_;
std::string Cyclone::no_capture_;
bool Cyclone::captured_ = false;

TEST_F(Cyclone, ComponentTakesEveryFrame) {
  EXPECT_EQ(ended_.exit_code, 0) << ended_.err;
  EXPECT_NE(ended_.err.find(std::to_string(frames_) + " frames processed, " +
                            std::to_string(expected_.refused) + " refused"),
            std::string::npos)
      << ended_.err;
}

TEST_F(Cyclone, ObjectsAndTheirDisposesArriveWithTheirKey) {
  ASSERT_GT(expected_.removed, 0u) << "the scenario has to have a removal to be a test";
  EXPECT_EQ(log_->objects.size(), expected_.objects);
  for (const auto& [uuid, id] : log_->objects) EXPECT_EQ(uuid, dds::object_uuid(77, ObjectId{id}));
  std::multiset<PeerLog::Uuid> removed;
  for (const PeerLog::Event& event : log_->events) {
    if (event.kind == 3) removed.insert(event.uuid);
  }
  EXPECT_EQ(removed.size(), expected_.removed);
  EXPECT_EQ(removed, std::multiset<PeerLog::Uuid>(log_->disposed.begin(), log_->disposed.end()));
}

TEST_F(Cyclone, EventsArriveInOrderWithoutAGap) {
  ASSERT_FALSE(log_->events.empty());
  std::size_t added = 0;
  for (std::size_t i = 0; i < log_->events.size(); ++i) {
    EXPECT_EQ(log_->events[i].seq, i + 1);
    EXPECT_TRUE(std::isfinite(log_->events[i].mu_after));
    if (log_->events[i].kind == 0) ++added;
  }
  EXPECT_EQ(added, expected_.objects + expected_.removed);
}

// By the types' names in pocd_interfaces and without keys, as rmw_cyclonedds_cpp would.
TEST_F(Cyclone, ReadersLikeThoseOfRos2GetObjectsRemovalsEventsAndHealth) {
  EXPECT_GT(log_->list_number, 1u);
  std::vector<PeerLog::Uuid> present;
  for (const auto& [uuid, id] : log_->objects) present.push_back(uuid);
  std::sort(log_->listed.begin(), log_->listed.end());
  EXPECT_EQ(log_->listed, present);
  EXPECT_EQ(std::multiset<PeerLog::Uuid>(log_->removed.begin(), log_->removed.end()),
            std::multiset<PeerLog::Uuid>(log_->disposed.begin(), log_->disposed.end()));
  std::vector<std::uint64_t> numbers;
  for (const PeerLog::Event& event : log_->events) numbers.push_back(event.seq);
  EXPECT_EQ(log_->ros_events, numbers);
  EXPECT_EQ(log_->health_epoch, 77u);
  EXPECT_EQ(log_->health_frames, static_cast<std::uint64_t>(frames_));
}

// The same frames give the same map through either vendor's middleware as offline, bit by bit, and
// it arrives as it was sent, as deltas and as tiles.
TEST_F(Cyclone, TilesAndDeltasGiveTheOfflineMap) {
  EXPECT_EQ(log_->gaps, 0u);
  EXPECT_EQ(log_->version, log_->manifest_version);
  EXPECT_EQ(log_->delta_digest, log_->manifest_digest);
  EXPECT_EQ(PeerLog::digest(log_->applied).hex(), log_->manifest_digest.hex());
  EXPECT_EQ(PeerLog::digest(log_->tiles).hex(), log_->manifest_digest.hex());
  EXPECT_EQ(log_->manifest_digest.hex(), expected_.map_digest);
  EXPECT_GT(log_->deltas, 1u);
}

TEST_F(Cyclone, EndOfTheComponentDisposesNothing) {
  EXPECT_EQ(log_->ended_disposed, 0u);
  EXPECT_EQ(log_->ended_without_writers, log_->objects.size());
}

TEST_F(Cyclone, AnalyserFindsNoMalformedPacket) {
  if (!no_capture_.empty()) GTEST_SKIP() << no_capture_;
  ASSERT_TRUE(captured_);
  const CommandResult dissected =
      run_command({"/usr/bin/tshark", "-n", "-r", (folder_->path() / "capture.pcapng").string(),
                   "-T", "fields", "-e", "rtps.vendorId", "-e", "rtps.sm.id", "-e", "_ws.malformed",
                   "-e", "_ws.expert.severity", "-e", "frame.number", "-e", "_ws.expert.message"});
  ASSERT_EQ(dissected.exit_code, 0) << dissected.err;
  const auto has = [](const std::string& line, const std::string& text) {
    return line.find(text) != std::string::npos;
  };
  std::map<std::string, int> understood;
  int bad = 0;
  std::istringstream lines(dissected.out);
  for (std::string line; std::getline(lines, line);) {
    for (const char* vendor : {"0x010f", "0x0110"}) {
      for (const char* kind : {"0x15", "0x16"}) {
        understood[std::string(vendor) + " " + kind] += has(line, vendor) && has(line, kind);
      }
    }
    const bool malformed = has(line, "_ws.malformed") || has(line, "8388608");  // severity: error
    if (malformed && ++bad < 10) ADD_FAILURE() << line;
  }
  EXPECT_EQ(bad, 0);
  // That it understood the packets is part of the test: samples of both vendors, and images in
  // fragments.
  EXPECT_GT(understood["0x010f 0x15"], 0);
  EXPECT_GT(understood["0x0110 0x15"], 0);
  EXPECT_GT(understood["0x0110 0x16"], 0);
}

}  // namespace
}  // namespace pocd
