// What waits for a disk does not grow without end.
#include <sqlite3.h>

#include "memory_run.hpp"

namespace pocd::test {
namespace {

ObjectEvent event_number(std::uint64_t sequence) {
  ObjectEvent event;
  event.sequence = sequence;
  event.kind = EventKind::kAdded;
  event.object = ObjectId{1};
  event.stamp_ns = static_cast<StampNs>(sequence);
  return event;
}

/// One event per call, as frames bring them.
void add_events(WarehouseMemory& memory, std::uint64_t first, std::uint64_t count) {
  for (std::uint64_t n = first; n < first + count; ++n) {
    FrameResult result;
    result.events.push_back(event_number(n));
    memory.add(result);
  }
}

// A disk that is full for weeks, while things come and go.
TEST(WaitingEvents, OfTooManyTheOldestAreLostAndCounted) {
  const ScratchFolder folder;
  constexpr std::uint64_t kMore = 20;
  {
    MemoryRunner run(circuit_config(), folder / "memory");
    run.process(small_frames());
    add_events(run.memory(), 1, WarehouseMemory::kMostWaiting);
    EXPECT_EQ(run.memory().status().events_lost, 0u);
    add_events(run.memory(), WarehouseMemory::kMostWaiting + 1, kMore);
    EXPECT_EQ(run.memory().status().events_lost, kMore);
    EXPECT_EQ(run.memory().status().events_waiting, WarehouseMemory::kMostWaiting);
    ASSERT_TRUE(run.finish());
    EXPECT_EQ(run.memory().status().events_waiting, 0u);
  }
  MemoryReader reader(folder / "memory");
  EXPECT_TRUE(reader.verify().empty());
  const auto first = reader.events(0, 1);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].event.sequence, kMore + 1) << "the newest ones are there";
}

TEST(WaitingEvents, NoneWaitForAFileThatIsNotWrittenAnyMore) {
  const ScratchFolder folder;
  MemoryConfig keep;
  keep.period_s = 0.0;
  MemoryRunner run(circuit_config(), folder / "memory", keep);
  run.process(small_frames());
  run.step();
  while (!run.memory().free()) ::usleep(1000);
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "memory/memory.sqlite").c_str(), &other), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(other, "DROP TABLE events", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(other);
  add_events(run.memory(), 1, 1);
  run.step();
  for (int n = 0; n < 500 && !run.memory().status().stopped; ++n) ::usleep(10'000);
  ASSERT_TRUE(run.memory().status().stopped) << run.memory().status().problem;
  add_events(run.memory(), 2, 1000);
  EXPECT_EQ(run.memory().status().events_waiting, 0u);
  EXPECT_EQ(run.memory().status().events_lost, 1000u);
}

}  // namespace
}  // namespace pocd::test
