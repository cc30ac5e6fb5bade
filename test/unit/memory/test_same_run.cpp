// A run that is ended and taken up again at random frames ends as the one that was not.
#include "memory/database.hpp"
#include "memory/schema.hpp"
#include "memory_run.hpp"
#include "pocd/common/random.hpp"

namespace pocd::test {

std::vector<std::string> stored_pieces(const std::filesystem::path& folder) {
  memory::Database database(folder / memory::kFileName, memory::Database::Access::kRead);
  std::vector<std::string> rows;
  for (const char* table :
       {"parts", "objects", "free_space", "regions", "tiles", "voxel_index", "voxels"}) {
    memory::Statement all(
        database, (std::string("SELECT key, data FROM ") + table + " ORDER BY key").c_str());
    while (all.step()) {
      const std::vector<std::uint8_t> data = all.blob(1);
      std::size_t skip = std::string(table) == "tiles" ? 8 : 0;  // the version counts steps
      rows.push_back(std::string(table) + std::to_string(all.integer(0)) + ":" +
                     std::string(data.begin() + static_cast<std::ptrdiff_t>(skip), data.end()));
    }
  }
  return rows;
}

namespace {

/// Four words in the course of the circuit, of what is known first.
std::optional<OperatorWord> circuit_words(std::uint64_t frames, const PocdPipeline& pipeline) {
  const std::uint64_t sixth = circuit_frames().size() / 6;
  if (frames % sixth != 0 || frames == 0) return std::nullopt;
  OperatorWord word;
  word.by = "test";
  word.region = "dock";
  const auto known = pipeline.objects();
  if (known.empty()) return std::nullopt;
  word.object = known.front().id;
  const Eigen::Vector2d at = known.front().box.pose.position_W.head<2>();
  for (const auto& corner :
       {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1), Eigen::Vector2d(0, 1)})
    word.polygon_W.push_back(at + corner);
  switch (frames / sixth) {
    case 2:
      word.kind = WordKind::kIgnoreRegion;
      return word;
    case 3:
      word.kind = WordKind::kForgetObject;
      return word;
    case 4:
      word.kind = WordKind::kHeedRegion;
      return word;
    case 5:
      word.kind = WordKind::kForgetRegion;
      return word;
    default:
      return std::nullopt;
  }
}

class SameRun : public ::testing::Test {
 protected:
  /// Without a stop, with a memory that is written once, at the end.
  struct Whole {
    Outcome outcome;
    std::vector<std::string> rows;
  };
  static const Whole& whole() {
    static const Whole result = [] {
      const ScratchFolder folder;
      MemoryRunner run(circuit_config(), folder / "memory");
      run.says = circuit_words;
      while (run.process(circuit_frames())) {
      }
      Whole all;
      all.outcome = run.outcome(folder / "map");
      EXPECT_TRUE(run.finish());
      all.rows = stored_pieces(folder / "memory");
      return all;
    }();
    return result;
  }
};

TEST_F(SameRun, IsTheRunWithoutAMemory) {
  MemoryRunner run(circuit_config());
  run.says = circuit_words;
  while (run.process(circuit_frames())) {
  }
  const ScratchFolder folder;
  const Outcome outcome = run.outcome(folder / "map");
  EXPECT_EQ(outcome.digest, whole().outcome.digest);
  EXPECT_EQ(outcome.voxels, whole().outcome.voxels);
  EXPECT_EQ(outcome.events, whole().outcome.events);
  EXPECT_GT(outcome.events.size(), 5u);
}

TEST_F(SameRun, WhateverFramesItIsStoppedAt) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const ScratchFolder folder;
    PipelineConfig config = circuit_config();
    if (seed % 2 == 0) {  // with regions that go to disk besides
      config.map.memory.limit = MapLimit::kBudget;
      config.map.memory.budget_mb = 4;
      config.map.memory.folder = folder.path().string();
    }
    config.threads = 1 + static_cast<int>(seed % 2);
    Outcome outcome;
    std::map<std::uint64_t, std::string> events;  // of the log and after it, by number
    int stops = 0;
    bool done = false;
    while (!done) {
      MemoryRunner run(config, folder / "memory");
      run.says = circuit_words;
      const std::uint64_t stop = run.next() + 1 + random.below(circuit_frames().size() / 4);
      while (run.next() < stop && run.process(circuit_frames())) {
        if (random.below(6) == 0) run.step();
      }
      for (const ObjectEvent& e : run.events()) events[e.sequence] = line(e);
      if (run.next() < circuit_frames().size()) {
        ++stops;
        continue;  // what came after the last step is lost, and made again
      }
      done = true;
      outcome = run.outcome(folder / "map");
      ASSERT_TRUE(run.finish());
    }
    EXPECT_GT(stops, 2);
    EXPECT_EQ(outcome.digest, whole().outcome.digest);
    EXPECT_EQ(outcome.voxels, whole().outcome.voxels);
    EXPECT_EQ(stored_pieces(folder / "memory"), whole().rows);
    std::vector<std::string> list;
    for (const auto& entry : events) list.push_back(entry.second);
    EXPECT_EQ(list, whole().outcome.events);
    std::vector<std::string> logged;
    MemoryReader log(folder / "memory");
    for (const LoggedEvent& e : log.events(0, 100000)) logged.push_back(line(e.event));
    EXPECT_EQ(logged, whole().outcome.events);
    EXPECT_EQ(log.info().digest.hex(), whole().outcome.digest);
    EXPECT_TRUE(log.verify().empty());
  }
}

}  // namespace
}  // namespace pocd::test
