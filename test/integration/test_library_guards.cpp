// The library in a fleet manager's process: nothing on the bus and nothing in a callback ends it.
#include <dlfcn.h>
#include <fastdds/rtps/builtin/liveliness/WLP.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "bus_harness.hpp"
#include "over_the_bus.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/bus_log.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_dds/object_watch.hpp"

namespace {

std::atomic<int> removing{0}, removed{0}, together{0};

}  // namespace

// Before Fast DDS's own, which changes a list without a lock: takes longer, and counts who comes
// while another thread is there.
namespace eprosima::fastrtps::rtps {

bool WLP::remove_local_reader(RTPSReader* reader) {
  using Function = bool (*)(WLP*, RTPSReader*);
  static const auto real = reinterpret_cast<Function>(
      dlsym(RTLD_NEXT, "_ZN8eprosima8fastrtps4rtps3WLP19remove_local_readerEPNS1_10RTPSReaderE"));
  if (removing.fetch_add(1) > 0) ++together;
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  const bool known = real(this, reader);
  ++removed;
  --removing;
  return known;
}

}  // namespace eprosima::fastrtps::rtps

namespace pocd {
namespace {

using Objects = dds::Writer<pocd_msgs::msg::ObjectStatePubSubType>;
using Heard = dds::Reader<pocd_msgs::msg::ObjectStatePubSubType>;
using Events = dds::Writer<pocd_msgs::msg::ObjectEventPubSubType>;

/// All that was logged, as long as it lives.
class LogBook {
 public:
  LogBook() {
    set_bus_log([this](LogLevel, const std::string& text) {
      const std::lock_guard<std::mutex> lock(mutex_);
      text_ += text + "\n";
    });
  }
  ~LogBook() { set_bus_log(nullptr); }
  std::string text() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return text_;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

bool write_state(Objects& objects, std::uint32_t id) {
  ObjectSnapshot object;
  object.id = static_cast<ObjectId>(id);
  auto state = dds::object_message(object, {0, 1}, ClassMap{}, 1, "map");
  return objects.write(state);
}
bool write_event(Events& events, std::uint32_t id) {
  ObjectEvent event;
  event.object = static_cast<ObjectId>(id);
  auto message = dds::event_message(event, {0, 1}, ClassMap{}, "map");
  return events.write(message);
}

TEST(LibraryGuards, CallbacksThatThrowAreSaidAndTheNextOnesAreCalled) {
  const LogBook log;
  const TestDomain domain;
  const auto bus = test_participant(domain);
  Objects objects(bus, dds::topics::kObjects);
  Events events(bus, dds::topics::kObjectEvents);
  std::atomic<int> seen{0}, heard{0};
  ObjectWatchOptions watching;
  watching.domain = domain.number();
  watching.on_object = [&](const WatchedObject&) {
    if (++seen == 1) throw std::runtime_error("the lane is not known");
  };
  const ObjectWatch watch(watching);
  MirrorOptions mirroring;
  mirroring.domain = domain.number();
  mirroring.on_event = [&](const ObjectEvent&, const std::string&) {
    if (++heard == 1) throw 1;
  };
  const MapMirror mirror(mirroring);
  ASSERT_TRUE(eventually([&] { return objects.matched() == 2 && events.matched() == 2; }));
  for (const std::uint32_t id : {1, 2, 3}) {
    EXPECT_TRUE(write_state(objects, id));
    EXPECT_TRUE(write_event(events, id));
  }
  EXPECT_TRUE(eventually([&] { return seen == 3 && heard == 3; }));
  EXPECT_TRUE(eventually([&] { return watch.status().callbacks.called == 3; }));
  EXPECT_EQ(watch.status().callbacks.failed, 1u);
  EXPECT_EQ(watch.status().callbacks.last_failure, "the lane is not known");
  EXPECT_TRUE(eventually([&] { return mirror.status().callbacks.called == 3; }));
  EXPECT_EQ(mirror.status().callbacks.failed, 1u);
  EXPECT_EQ(watch.status().failures + mirror.status().failures, 0u);
  EXPECT_NE(log.text().find("pocd_object_watch: a callback has thrown: the lane is not known"),
            std::string::npos)
      << log.text();
}

// A watch whose program hangs keeps few samples, and in the end says what is there.
TEST(LibraryGuards, ASlowProgramCostsNoMemoryAndMissesNoLastState) {
  talk_over_the_bus();  // the short cut within a process loses what the reader has no room for
  const LogBook log;
  const TestDomain domain;
  const auto bus = test_participant(domain);
  Objects objects(bus, dds::topics::kObjects);
  std::mutex mutex;
  std::condition_variable changed;
  bool open = false;
  std::map<std::uint32_t, std::uint32_t> last;  // observations by id
  std::atomic<std::uint64_t> calls{0};
  ObjectWatchOptions options;
  options.domain = domain.number();
  options.callbacks.most_waiting = 5;
  options.most_objects = 3;
  options.on_object = [&](const WatchedObject& object) {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return open; });
    last[to_index(object.state.id)] = object.state.observations;
    ++calls;
  };
  const ObjectWatch watch(options);
  ASSERT_TRUE(eventually([&] { return objects.matched() == 1; }));
  std::uint32_t rounds = 0;
  const auto write_round = [&] {
    ++rounds;
    for (const std::uint32_t id : {1, 2, 3}) {
      ObjectSnapshot object;
      object.id = static_cast<ObjectId>(id);
      object.observations = rounds;
      auto state = dds::object_message(object, {0, 1}, ClassMap{}, 1, "map");
      EXPECT_TRUE(objects.write(state));
    }
  };
  const auto full = [&] { return watch.status().callbacks.waiting == 5; };
  // The writer keeps the last state of each object: written at once, no more may ever arrive. From
  // here on nothing returns early, as the watch ends only when its callback does.
  EXPECT_TRUE(eventually([&] {
    write_round();
    return full();
  }));
  for (int more = 0; more < 4000; ++more) write_round();  // more than the watch's reader keeps
  EXPECT_TRUE(full());
  {
    const std::lock_guard<std::mutex> lock(mutex);
    open = true;
  }
  changed.notify_all();
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return last == std::map<std::uint32_t, std::uint32_t>{{1, rounds}, {2, rounds}, {3, rounds}};
  })) << calls;
  EXPECT_EQ(watch.status().callbacks.dropped, 0u);
  // Names on the bus are the peers' choice.
  EXPECT_TRUE(write_state(objects, 4));
  EXPECT_TRUE(eventually([&] { return watch.status().too_many == 1; }));
  EXPECT_EQ(watch.status().objects, 3u);
}

TEST(LibraryGuards, ThreadsDeleteReadersOfOneParticipantOneAfterTheOther) {
  removing = removed = together = 0;
  const TestDomain domain;
  const auto bus = test_participant(domain);
  const auto make_and_delete = [&] {
    dds::Wakeup wakeup;
    for (int round = 0; round < 20; ++round) Heard(bus, dds::topics::kObjects, wakeup);
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back(make_and_delete);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(removed, 60);
  EXPECT_EQ(together, 0);
}

// Whoever makes or deletes one waits for listeners, and those for the log.
TEST(LibraryGuards, ALogMakesAndDeletesNoReader) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  auto reader = std::make_unique<Heard>(bus, dds::topics::kObjects, wakeup);
  const auto said_of = [](const std::function<void()>& task) {
    testing::internal::CaptureStderr();
    set_bus_log([&](LogLevel, const std::string&) { task(); });
    dds::log(LogLevel::kWarning, "the message itself");
    set_bus_log(nullptr);
    return testing::internal::GetCapturedStderr();
  };
  const std::string made = said_of([&] { Heard(bus, dds::topics::kObjects, wakeup); });
  EXPECT_NE(made.find("pocd: warning: the message itself"), std::string::npos) << made;
  EXPECT_NE(made.find("topic pocd/objects: the function given to set_bus_log must not make"),
            std::string::npos)
      << made;
  MirrorOptions options;
  options.domain = domain.number();
  const std::string mirrored = said_of([&] { const MapMirror mirror(options); });
  EXPECT_NE(mirrored.find("set_bus_log must not make a reader"), std::string::npos) << mirrored;
  const std::string deleted = said_of([&] { reader.reset(); });
  EXPECT_NE(deleted.find("topic pocd/objects: the function given to set_bus_log must not delete"),
            std::string::npos)
      << deleted;
  const std::string set = said_of([] { set_bus_log(nullptr); });
  EXPECT_NE(set.find("set_bus_log is called by the function that was given to it"),
            std::string::npos)
      << set;
  const Heard after(bus, dds::topics::kObjects, wakeup);  // as before, beside a log
}

TEST(LibraryGuards, SayNothingOnStdout) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  {
    const TestDomain domain;
    const auto bus = test_participant(domain);
    dds::Writer<pocd_msgs::msg::MapDeltaPubSubType> best_effort(
        bus, dds::topics::kMapDeltas, dds::topics::kMapDeltas.name, dds::topics::best_effort(1));
    MirrorOptions options;
    options.domain = domain.number();
    const MapMirror mirror(options);
    EXPECT_TRUE(eventually([&] { return best_effort.incompatible() > 0; }));
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("pocd: warning: pocd/map/deltas: a reader asks for reliability"),
            std::string::npos)
      << said;
}

}  // namespace
}  // namespace pocd
