// A node with a memory that is killed and started again, and who follows it.
#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "bus_harness.hpp"
#include "nav_msgsPubSubTypes.h"
#include "pocd/common/check.hpp"
#include "pocd/memory/memory_reader.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_dds/object_watch.hpp"

namespace pocd {
namespace {

using Uuid = std::array<std::uint8_t, 16>;

MirrorOptions on(const TestDomain& domain) {
  MirrorOptions options;
  options.domain = domain.number();
  return options;
}

/// What an object watch has heard.
struct Heard {
  explicit Heard(const TestDomain& domain) {
    options.domain = domain.number();
    options.on_object = [this](const WatchedObject& object) {
      const std::lock_guard<std::mutex> lock(mutex);
      present[object.uuid] = object;
    };
    options.on_gone = [this](const WatchedObject& object, Gone why) {
      const std::lock_guard<std::mutex> lock(mutex);
      present.erase(object.uuid);
      replaced += why == Gone::kReplaced;
      forgotten += why == Gone::kForgotten;
    };
    watch = std::make_unique<ObjectWatch>(options);
  }
  std::map<Uuid, WatchedObject> objects() {
    const std::lock_guard<std::mutex> lock(mutex);
    return present;
  }
  int objects_replaced() {
    const std::lock_guard<std::mutex> lock(mutex);
    return replaced;
  }
  int objects_forgotten() {
    const std::lock_guard<std::mutex> lock(mutex);
    return forgotten;
  }

  ObjectWatchOptions options;
  std::mutex mutex;
  std::map<Uuid, WatchedObject> present;
  int replaced = 0, forgotten = 0;
  std::unique_ptr<ObjectWatch> watch;
};

class NodeMemoryTest : public ::testing::Test {
 protected:
  std::string folder() const { return (scratch_.path() / "memory").string(); }
  std::vector<std::string> node(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> command =
        node_command(domain_, {"--lossless", "--set", "node.memory.folder=" + folder(), "--set",
                               "node.memory.period_s=0.1", "--set", "node.map_period_s=0.1"});
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  /// Everything that was processed is on disk.
  bool stored(std::uint64_t version) {
    return eventually([&] {
      try {
        return MemoryReader(folder()).info().map_version >= version;
      } catch (const InputError&) {
        return false;
      }
    });
  }

  TestDomain domain_;
  TemporaryFolder scratch_;
};

TEST_F(NodeMemoryTest, AKilledNodeGoesOnAndFollowersKeepTheirObjects) {
  MapMirror mirror(on(domain_));
  Heard heard(domain_);
  std::map<Uuid, WatchedObject> before;
  MapDigest digest;
  {
    Process first(node({"--epoch", "1"}));
    ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "70"})).exit_code, 0);
    const auto in_step = [](const MirrorStatus& s) {
      return s.in_step && s.version > 0 && s.objects > 0;
    };
    ASSERT_TRUE(mirror.wait_until(in_step, kGenerous)) << mirror.status().stale_because;
    // Until nothing is left to be published or stored.
    std::uint64_t version = 0;
    ASSERT_TRUE(eventually([&] {
      const bool still = mirror.status().version == version && version > 0;
      version = mirror.status().version;
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      return still;
    }));
    ASSERT_TRUE(stored(version));
    ASSERT_TRUE(eventually([&] { return heard.objects().size() == mirror.status().objects; }));
    digest = mirror.status().digest;
    before = heard.objects();
    ASSERT_FALSE(before.empty());
    for (const auto& [uuid, object] : before) EXPECT_TRUE(object.state.seen_in_run);
    first.signal(SIGKILL);
    first.wait();
  }
  ASSERT_TRUE(MemoryReader(folder()).verify().empty());
  const std::uint64_t snapshots = mirror.status().snapshots_taken,
                      gathered = mirror.status().gathered;
  Process second(node({"--epoch", "2"}));
  const auto taken_over = [](const MirrorStatus& s) { return s.in_step && s.epoch == 2; };
  ASSERT_TRUE(mirror.wait_until(taken_over, kGenerous)) << mirror.status().stale_because;
  EXPECT_EQ(mirror.status().digest, digest);
  EXPECT_EQ(mirror.status().objects, before.size());
  EXPECT_EQ(mirror.status().snapshots_taken + mirror.status().gathered, snapshots + gathered)
      << "the map is the same: nothing is fetched";
  // The same objects, under the same names, of the new run; nobody has looked yet.
  ASSERT_TRUE(eventually([&] {
    const auto now = heard.objects();
    return now.size() == before.size() &&
           std::all_of(now.begin(), now.end(), [](const auto& o) { return o.second.epoch == 2; });
  }));
  for (const auto& [uuid, object] : heard.objects()) {
    ASSERT_EQ(before.count(uuid), 1u);
    EXPECT_FALSE(object.state.seen_in_run);
    EXPECT_EQ(object.lineage, before.at(uuid).lineage);
    EXPECT_EQ(object.state.last_seen_ns, before.at(uuid).state.last_seen_ns);
  }
  EXPECT_EQ(heard.objects_replaced(), 0);
  // A late joiner gets all of it.
  MapMirror late(on(domain_));
  ASSERT_TRUE(late.wait_until(taken_over, kGenerous)) << late.status().stale_because;
  EXPECT_EQ(late.status().digest, digest);
  // On the second drive a box is gone: told by its old name.
  ASSERT_EQ(run_command(play_command(domain_)).exit_code, 0);
  ASSERT_TRUE(eventually([&] {
    const auto now = heard.objects();
    return std::any_of(before.begin(), before.end(),
                       [&](const auto& o) { return now.count(o.first) == 0; });
  }));
  const auto now = heard.objects();
  EXPECT_TRUE(std::any_of(now.begin(), now.end(), [&](const auto& o) {
    return before.count(o.first) == 1 && o.second.state.seen_in_run;
  }));
  second.signal(SIGINT);
  EXPECT_EQ(second.wait().exit_code, 0);
  EXPECT_TRUE(MemoryReader(folder()).info().ended_clean);
}

TEST_F(NodeMemoryTest, RegionsSayWhenTheyWereLastLookedAt) {
  MirrorOptions with_looks = on(domain_);
  with_looks.looks = true;
  MapMirror mirror(with_looks);
  {
    Process first(node({"--epoch", "1"}));
    ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "70"})).exit_code, 0);
    first.signal(SIGINT);
    ASSERT_EQ(first.wait().exit_code, 0);
  }
  const auto stored = MemoryReader(folder()).last_looks();
  ASSERT_FALSE(stored.empty());
  // The copy says just what is stored, and whether the run has looked.
  const auto says = [&](const MapMirror& who, bool in_run) {
    const std::vector<MirrorRegion> regions = who.contents().regions;
    if (regions.size() != stored.size()) return false;
    for (std::size_t i = 0; i < stored.size(); ++i) {
      if (!(regions[i].region == stored[i].first) || regions[i].looked_in_run != in_run ||
          regions[i].last_looked_ns != stored[i].second) {
        return false;
      }
    }
    return true;
  };
  EXPECT_TRUE(eventually([&] { return says(mirror, true); }));
  Process second(node({"--epoch", "2"}));
  EXPECT_TRUE(eventually([&] { return mirror.status().epoch == 2 && says(mirror, false); }));
  MapMirror late(with_looks);
  EXPECT_TRUE(eventually([&] { return says(late, false); }));
  const MapMirror without(on(domain_));
  ASSERT_TRUE(without.wait_until([](const MirrorStatus& s) { return s.in_step && s.epoch == 2; },
                                 kGenerous));
  EXPECT_TRUE(without.contents().regions.empty()) << "nobody asked for it";
  ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "5"})).exit_code, 0);
  EXPECT_TRUE(eventually([&] {
    const auto regions = late.contents().regions;
    return std::any_of(regions.begin(), regions.end(),
                       [](const MirrorRegion& r) { return r.looked_in_run; });
  }));
  second.signal(SIGINT);
  EXPECT_EQ(second.wait().exit_code, 0);
}

TEST_F(NodeMemoryTest, TheGridShowsWhatNobodyHasLookedAtAsConfigured) {
  {
    Process first(node());
    ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "70"})).exit_code, 0);
    first.signal(SIGINT);
    ASSERT_EQ(first.wait().exit_code, 0);
  }
  const auto participant = test_participant(domain_);
  dds::Wakeup wakeup;
  for (const int value : {-1, 50}) {
    SCOPED_TRACE(value);
    dds::Reader<nav_msgs::msg::OccupancyGridPubSubType> grids(participant, dds::topics::kOccupancy,
                                                              wakeup);
    Process again(node({"--set", "node.outputs.occupancy_not_looked_at=" + std::to_string(value)}));
    // Free, occupied, as configured, anything else; of the newest grid.
    std::map<int, int> cells;
    const auto take = [&] {
      nav_msgs::msg::OccupancyGrid grid;
      dds::SampleMeta meta;
      while (grids.take(grid, meta)) {
        if (!meta.valid) continue;
        cells.clear();
        for (const std::int8_t cell : grid.data()) ++cells[cell];
      }
      return !cells.empty();
    };
    ASSERT_TRUE(eventually(take));
    EXPECT_EQ(cells.count(0) + cells.count(100), 0u) << "nobody has looked";
    EXPECT_GT(cells[value], 0);
    ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "70"})).exit_code, 0);
    EXPECT_TRUE(eventually([&] { return take() && cells[0] > 0 && cells[100] > 0; }));
    again.signal(SIGINT);
    EXPECT_EQ(again.wait().exit_code, 0);
  }
}

TEST_F(NodeMemoryTest, EventsSinceANumberAcrossRestarts) {
  {
    Process first(node({"--epoch", "1"}));
    ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "70"})).exit_code, 0);
    first.signal(SIGINT);
    ASSERT_EQ(first.wait().exit_code, 0);
  }
  MemoryReader log(folder());
  const std::vector<LoggedEvent> known = log.events(0, 1000);
  ASSERT_GE(known.size(), 2u);
  Process second(node({"--epoch", "2"}));
  const auto participant = test_participant(domain_);
  dds::Wakeup wakeup;
  dds::Writer<pocd_msgs::msg::EventsRequestPubSubType> requests(participant,
                                                                dds::topics::kEventsRequest);
  dds::Reader<pocd_msgs::msg::EventsReplyPubSubType> replies(participant, dds::topics::kEventsReply,
                                                             wakeup);
  ASSERT_TRUE(eventually([&] { return requests.matched() > 0 && replies.matched() > 0; }));
  const auto ask = [&](std::uint64_t after, std::uint32_t most) {
    pocd_msgs::msg::EventsRequest request;
    request.requester({1, 2, 3});
    request.after_seq(after);
    request.most(most);
    requests.write(request);
    pocd_msgs::msg::EventsReply reply;
    dds::SampleMeta meta;
    EXPECT_TRUE(eventually([&] { return replies.take(reply, meta) && meta.valid; }));
    EXPECT_EQ(reply.requester(), request.requester());
    EXPECT_EQ(reply.problem(), "");
    return reply;
  };
  const auto all = ask(0, 1000);
  ASSERT_EQ(all.events().size(), known.size());
  EXPECT_EQ(all.lineage(), log.lineage());
  EXPECT_EQ(all.first_seq(), 1u);
  EXPECT_EQ(all.last_seq(), known.back().event.sequence);
  for (std::size_t i = 0; i < known.size(); ++i) {
    EXPECT_EQ(all.events()[i].seq(), known[i].event.sequence);
    EXPECT_EQ(all.events()[i].epoch(), 1u);
    EXPECT_EQ(all.events()[i].uuid(), dds::object_uuid(log.lineage(), known[i].event.object));
  }
  EXPECT_EQ(ask(0, 1).events().size(), 1u);
  EXPECT_EQ(ask(known[0].event.sequence, 1000).events().size(), known.size() - 1);
  EXPECT_TRUE(ask(~0ull, 10).events().empty());
  second.signal(SIGINT);
  EXPECT_EQ(second.wait().exit_code, 0);
}

TEST_F(NodeMemoryTest, WhatAnOperatorSaysIsFollowedRecordedAndAnswered) {
  Heard heard(domain_);
  Process first(node({"--epoch", "1", "--set", "node.commands=true"}));
  ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "70"})).exit_code, 0);
  ASSERT_TRUE(eventually([&] { return heard.objects().size() >= 2; }));
  const auto say = [&](std::vector<std::string> words) {
    words.insert(words.begin(), bin("pocd_command"));
    for (const char* more : {"--by", "mira", "--domain"}) words.emplace_back(more);
    words.push_back(domain_.text());
    return run_command(words);
  };
  const WatchedObject object = heard.objects().begin()->second;
  const CommandResult forgotten = say({"forget-object", std::to_string(to_index(object.state.id))});
  EXPECT_EQ(forgotten.exit_code, 0) << forgotten.err;
  EXPECT_NE(forgotten.out.find("done: 1 object forgotten; event "), std::string::npos)
      << forgotten.out;
  ASSERT_TRUE(eventually([&] { return heard.objects().count(object.uuid) == 0; }));
  EXPECT_EQ(heard.objects_forgotten(), 1) << "nobody has seen it go";
  EXPECT_EQ(heard.objects_replaced(), 0);
  // The answer came when it was on disk.
  const auto last = [&] { return MemoryReader(folder()).events(0, 10000).back(); };
  EXPECT_EQ(last().event.kind, EventKind::kOperator);
  EXPECT_EQ(last().event.by, "mira");
  EXPECT_EQ(last().event.evidence.rule, "forget_object");
  const CommandResult again = say({"forget-object", std::to_string(to_index(object.state.id))});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.out.find("is not known"), std::string::npos) << again.out;
  EXPECT_EQ(say({"ignore-region", "dock", "--polygon", "0,0 1,0 1,1"}).exit_code, 0);
  EXPECT_EQ(last().event.evidence.rule, "ignore_region dock");
  EXPECT_EQ(say({"save"}).exit_code, 0);
  first.signal(SIGKILL);
  first.wait();
  // What was said holds in the next run.
  Process second(node({"--epoch", "2", "--set", "node.commands=true"}));
  EXPECT_EQ(say({"heed-region", "dock"}).exit_code, 0);
  EXPECT_EQ(say({"heed-region", "dock"}).exit_code, 1);
  EXPECT_EQ(say({"reset"}).exit_code, 0);
  ASSERT_TRUE(eventually([&] { return heard.objects().empty(); }));
  EXPECT_EQ(MemoryReader(folder()).info().objects, 0u);
  EXPECT_TRUE(MemoryReader(folder()).verify().empty());
  second.signal(SIGINT);
  EXPECT_EQ(second.wait().exit_code, 0);
}

TEST_F(NodeMemoryTest, ACommandThatComesAgainIsAnsweredAndNotFollowedAgain) {
  Process node_process(node_command(domain_, {"--lossless", "--set", "node.commands=true"}));
  const auto participant = test_participant(domain_);
  dds::Wakeup wakeup;
  dds::Writer<pocd_msgs::msg::CommandPubSubType> commands(participant, dds::topics::kCommand);
  dds::Reader<pocd_msgs::msg::CommandReplyPubSubType> replies(participant,
                                                              dds::topics::kCommandReply, wakeup);
  ASSERT_TRUE(eventually([&] { return commands.matched() > 0 && replies.matched() > 0; }));
  const auto say = [&](std::uint64_t number, std::uint8_t kind, const std::string& by) {
    pocd_msgs::msg::Command command;
    command.requester({7});
    command.number(number);
    command.kind(kind);
    command.by(by);
    commands.write(command);
    pocd_msgs::msg::CommandReply reply;
    dds::SampleMeta meta;
    EXPECT_TRUE(eventually([&] { return replies.take(reply, meta) && meta.valid; }));
    EXPECT_EQ(reply.number(), number);
    return reply;
  };
  const auto once = say(1, 2, "mira");
  EXPECT_TRUE(once.done()) << once.text();
  EXPECT_FALSE(once.stored()) << "there is no memory";
  EXPECT_EQ(say(1, 2, "mira").seq(), once.seq());
  EXPECT_EQ(say(2, 2, "mira").seq(), once.seq() + 1);
  EXPECT_NE(say(3, 9, "mira").text().find("kind 9 is no command"), std::string::npos);
  EXPECT_NE(say(4, 2, "").text().find("by is empty"), std::string::npos);
  EXPECT_NE(say(5, 0, "mira").text().find("not of this lineage"), std::string::npos);
  const auto saved = say(6, 6, "mira");
  EXPECT_FALSE(saved.done());
  EXPECT_NE(saved.text().find("no memory"), std::string::npos) << saved.text();
  node_process.signal(SIGINT);
  EXPECT_EQ(node_process.wait().exit_code, 0);
}

TEST_F(NodeMemoryTest, WithoutCommandsNobodyListens) {
  Process quiet(node());
  ASSERT_TRUE(
      eventually([&] { return quiet.err().find("running on domain") != std::string::npos; }));
  const CommandResult said = run_command(
      {bin("pocd_command"), "reset", "--by", "mira", "--timeout", "2", "--domain", domain_.text()});
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_NE(said.err.find("node.commands"), std::string::npos) << said.err;
  quiet.signal(SIGINT);
  EXPECT_EQ(quiet.wait().exit_code, 0);
}

TEST_F(NodeMemoryTest, ASecondNodeOnTheFolderIsRefused) {
  Process first(node());
  ASSERT_TRUE(
      eventually([&] { return first.err().find("running on domain") != std::string::npos; }));
  const CommandResult second = run_command(node({"--set", "node.map_id=2"}));
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.err.find("is in use by process " + std::to_string(first.pid())),
            std::string::npos)
      << second.err;
  first.signal(SIGINT);
  EXPECT_EQ(first.wait().exit_code, 0);
}

TEST_F(NodeMemoryTest, AnEpochThatIsUsedAgainIsNoticed) {
  MapMirror mirror(on(domain_));
  const auto whole = [](const MirrorStatus& s) { return s.in_step && s.version > 3; };
  {
    Process first(
        node_command(domain_, {"--lossless", "--epoch", "5", "--set", "node.map_period_s=0.1"}));
    ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "60"})).exit_code, 0);
    ASSERT_TRUE(mirror.wait_until(whole, kGenerous));
    first.signal(SIGKILL);
    first.wait();
  }
  const std::uint64_t version = mirror.status().version;
  Process again(node_command(domain_, {"--lossless", "--epoch", "5"}));
  const auto noticed = [&](const MirrorStatus& s) { return s.corrupt > 0 && s.version < version; };
  EXPECT_TRUE(mirror.wait_until(noticed, kGenerous)) << mirror.status().stale_because;
  ASSERT_EQ(run_command(play_command(domain_, {"--max-frames", "10"})).exit_code, 0);
  EXPECT_TRUE(mirror.wait_until(
      [&](const MirrorStatus& s) { return s.in_step && s.version > 0 && s.version < version; },
      kGenerous))
      << mirror.status().stale_because;
  again.signal(SIGINT);
  EXPECT_EQ(again.wait().exit_code, 0);
}

}  // namespace
}  // namespace pocd
