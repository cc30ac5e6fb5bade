// Processes that are killed at any moment, and go on where they were.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>

#include "memory_run.hpp"
#include "pocd/common/random.hpp"

namespace pocd::test {
namespace {

/// POCD_KILLS: how often; for a long run by hand.
int kills_wanted() {
  const char* text = std::getenv("POCD_KILLS");
  return text != nullptr ? std::atoi(text) : 200;
}

/// A step after every frame, so that most kills meet one that is being written. Counts them.
int run_to_the_end(const std::filesystem::path& folder, std::atomic<std::uint64_t>& steps) {
  MemoryRunner run(circuit_config(), folder);
  while (run.process(small_frames())) {
    run.step();
    ++steps;
  }
  return run.finish() ? 0 : 1;
}

/// Waits until the child has made so many steps, or has ended.
void wait_for_steps(pid_t child, const std::atomic<std::uint64_t>& steps, std::uint64_t wanted) {
  siginfo_t info{};
  while (steps < wanted &&
         ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == 0) {
    ::usleep(200);
  }
}

TEST(KilledMemory, HoldsAStateThatWasAndGoesOnToTheSameEnd) {
  std::map<StampNs, std::string> digest_at;  // of every frame
  std::vector<std::string> events;
  std::string last_digest;
  {
    MemoryRunner whole(circuit_config());
    digest_at[0] = whole.publisher().digest().hex();
    for (std::size_t i = 0; whole.process(small_frames()); ++i) {
      whole.publish();
      digest_at[small_frames()[i].stamp_ns] = last_digest = whole.publisher().digest().hex();
    }
    for (const ObjectEvent& e : whole.events()) events.push_back(line(e));
  }
  const int wanted = kills_wanted();
  void* shared = ::mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  auto& steps = *new (shared) std::atomic<std::uint64_t>(0);
  Random random(1);
  int kills = 0, ends = 0, steps_found = 0;
  while (kills < wanted) {
    const ScratchFolder folder;
    std::uint64_t lineage = 0;
    StampNs reached_ns = 0;
    for (bool ended = false; !ended && kills < wanted;) {
      steps = 0;
      const pid_t child = ::fork();
      if (child == 0) {
        int code = 99;
        try {
          code = run_to_the_end(folder / "memory", steps);
        } catch (...) {
        }
        ::_exit(code);
      }
      // Sometimes before it has come to anything.
      if (random.below(8) > 0) wait_for_steps(child, steps, 1 + random.below(12));
      ::usleep(static_cast<useconds_t>(random.below(4'000)));
      ::kill(child, SIGKILL);
      int status = 0;
      ::waitpid(child, &status, 0);
      ended = WIFEXITED(status);
      if (ended) {
        ASSERT_EQ(WEXITSTATUS(status), 0);
      } else {
        ++kills;
      }
      if (!std::filesystem::exists(folder / "memory/memory.sqlite")) continue;
      MemoryInfo info;
      try {
        MemoryReader reader(folder / "memory");
        const auto wrong = reader.verify();
        ASSERT_TRUE(wrong.empty()) << wrong.front();
        info = reader.info();
        if (ended) {
          std::vector<std::string> logged;
          for (const LoggedEvent& e : reader.events(0, 100000)) logged.push_back(line(e.event));
          EXPECT_EQ(logged, events);
          EXPECT_EQ(info.digest.hex(), last_digest);
          ++ends;
        }
      } catch (const InputError& error) {  // killed before there was anything
        ASSERT_EQ(reached_ns, 0) << error.what();
        continue;
      }
      ASSERT_TRUE(lineage == 0 || info.lineage == lineage);
      lineage = info.lineage;
      ASSERT_EQ(digest_at.count(info.stamp_ns), 1u) << info.stamp_ns;
      ASSERT_EQ(info.digest.hex(), digest_at[info.stamp_ns]);
      ASSERT_GE(info.stamp_ns, reached_ns) << "what was stored is not lost";
      steps_found += info.stamp_ns > reached_ns;
      reached_ns = info.stamp_ns;
    }
  }
  EXPECT_GT(steps_found, wanted / 4);
  if (wanted >= 100) {
    EXPECT_GT(ends, 0);
  }
  ::munmap(shared, sizeof(std::atomic<std::uint64_t>));
  RecordProperty("kills", kills);
  RecordProperty("runs_to_the_end", ends);
}

}  // namespace
}  // namespace pocd::test
