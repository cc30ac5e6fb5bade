// Files with one defect each: refused with what is wrong, or the loss is stated.
#include "memory/database.hpp"
#include "memory/schema.hpp"
#include "memory_run.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"

namespace pocd::test {
namespace {

using memory::Database;

class DamagedMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    MemoryRunner run(circuit_config(), folder_ / "memory");
    for (int i = 0; i < 60; ++i) run.process(circuit_frames());
    ASSERT_GE(run.pipeline().objects().size(), 2u);
    ASSERT_TRUE(run.finish());
    run.outcome(folder_ / "map");
  }
  void damage(const std::string& sql) {
    Database database(folder_ / "memory/memory.sqlite", Database::Access::kWrite);
    database.execute(sql);
    ASSERT_GT(sqlite3_total_changes(database.handle()), 0) << sql;
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)");
  }
  /// "" when the memory is taken for a good one.
  std::string error() {
    try {
      MemoryRunner run(circuit_config(), folder_ / "memory");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string verify() {
    std::string all;
    try {
      for (const std::string& what : MemoryReader(folder_ / "memory").verify()) all += what + "\n";
    } catch (const InputError& error) {
      return error.what();
    }
    return all;
  }
  ScratchFolder folder_;
};

struct Defect {
  const char* name;
  const char* sql;
  const char* words;
};

class OneDefect : public DamagedMemory, public ::testing::WithParamInterface<Defect> {};

TEST_P(OneDefect, IsRefusedAndNamed) {
  ASSERT_EQ(error(), "");
  ASSERT_EQ(verify(), "");
  damage(GetParam().sql);
  const std::string why = error();
  EXPECT_NE(why.find(GetParam().words), std::string::npos) << why;
  EXPECT_NE(why.find("memory.sqlite"), std::string::npos) << why;
  EXPECT_NE(verify().find(GetParam().words), std::string::npos) << verify();
}

INSTANTIATE_TEST_SUITE_P(
    Each, OneDefect,
    ::testing::Values(
        Defect{"Object",
               "UPDATE objects SET data = zeroblob(20) WHERE key = (SELECT min(key) FROM objects)",
               "of objects is damaged"},
        Defect{"Part", "UPDATE parts SET sum = sum + 1 WHERE key = 1", "row 1 of parts is damaged"},
        Defect{"PartMissing", "DELETE FROM parts WHERE key = 2", "parts has 3 rows"},
        Defect{"ObjectMissing", "DELETE FROM objects WHERE key = (SELECT max(key) FROM objects)",
               "objects has"},
        Defect{
            "ObjectExchanged",
            "UPDATE objects SET data = (SELECT data FROM objects ORDER BY key DESC LIMIT 1), sum = "
            "(SELECT sum FROM objects ORDER BY key DESC LIMIT 1) WHERE key = (SELECT min(key) FROM "
            "objects)",
            "of objects is damaged"},
        Defect{"FreeSpace",
               "UPDATE free_space SET data = substr(data, 2) WHERE key = (SELECT min(key) FROM "
               "free_space)",
               "of free_space is damaged"},
        Defect{"FreeSpaceMissing",
               "DELETE FROM free_space WHERE key = (SELECT min(key) FROM free_space)",
               "free_space has"},
        Defect{"Tile",
               "UPDATE tiles SET data = zeroblob(99) WHERE key = (SELECT min(key) FROM tiles)",
               "of tiles is damaged"},
        Defect{"TileMissing", "DELETE FROM tiles WHERE key = (SELECT min(key) FROM tiles)",
               "tiles has"},
        Defect{"Index",
               "UPDATE voxel_index SET data = zeroblob(5) WHERE key = (SELECT min(key) FROM "
               "voxel_index)",
               "of voxel_index is damaged"},
        Defect{"IndexMissing",
               "DELETE FROM voxel_index WHERE key = (SELECT max(key) FROM voxel_index)",
               "voxel_index has"},
        Defect{"State", "UPDATE state SET data = substr(data, 1, 40)",
               "state of the last step is damaged"},
        Defect{"Lineage", "DELETE FROM meta WHERE name = 'lineage'", "has no lineage"}),
    [](const auto& info) { return info.param.name; });

TEST_F(DamagedMemory, VoxelsThatCannotBeReadAreLostAndStated) {
  damage(
      "UPDATE voxels SET data = zeroblob(50) WHERE key = (SELECT key FROM voxels LIMIT 1 OFFSET "
      "3)");
  EXPECT_NE(verify().find("of voxels is damaged"), std::string::npos);
  MemoryRunner run(circuit_config(), folder_ / "memory");
  const MapDigest before = run.publisher().digest();
  std::string told;
  for (const BlockKey& key : run.pipeline().map().keys_by_region())
    run.pipeline().map().recall(key);
  if (const auto problem = run.pipeline().map().take_problem()) told = *problem;
  EXPECT_NE(told.find("are lost"), std::string::npos) << told;
  EXPECT_NE(told.find("memory.sqlite"), std::string::npos) << told;
  EXPECT_GT(run.pipeline().map().memory_status().blocks_lost, 0u);
  // Copies of the map hear of it, and the memory is whole again without what is lost.
  run.publish();
  EXPECT_NE(run.publisher().digest(), before);
  ASSERT_TRUE(run.finish());
  EXPECT_EQ(verify(), "");
}

TEST_F(DamagedMemory, DamagedEventsAreLeftOutAndCounted) {
  damage("UPDATE events SET data = zeroblob(9) WHERE seq = (SELECT max(seq) FROM events)");
  EXPECT_EQ(error(), "");
  MemoryReader log(folder_ / "memory");
  const std::size_t whole = log.info().events;
  EXPECT_EQ(log.events(0, 100000).size() + 1, whole);
  EXPECT_EQ(log.damaged_events(), 1u);
  EXPECT_NE(verify().find("1 damaged events"), std::string::npos);
}

// Bytes of the file change where nobody has looked: found by verify, or by who reads them; never a
// map that is called right.
TEST_F(DamagedMemory, AnyPageThatChangesIsNoticedOrOfNoConsequence) {
  const std::filesystem::path file = folder_ / "memory/memory.sqlite";
  std::ifstream in(file, std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  in.close();
  const auto read = [&] {
    MemoryRunner run(circuit_config(), folder_ / "memory");
    return run.outcome(folder_ / "map");
  };
  const Outcome expected = read();
  int noticed = 0;
  Random random(5);
  for (int trial = 0; trial < 40; ++trial) {
    std::string bad = good;
    const std::size_t page = random.below(bad.size() / 4096) * 4096;
    for (int i = 0; i < 64; ++i)
      bad[page + random.below(4096)] = static_cast<char>(random.below(256));
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bad;
    std::filesystem::remove(file.string() + "-wal");
    std::filesystem::remove(file.string() + "-shm");
    const bool told = verify() != "";
    noticed += told;
    std::optional<Outcome> found;
    try {
      found = read();
    } catch (const InputError&) {
      EXPECT_TRUE(told) << "page " << page;
      continue;
    }
    if (found->digest != expected.digest || found->voxels != expected.voxels) {
      EXPECT_TRUE(told) << "page " << page;
    }
  }
  EXPECT_GT(noticed, 20);
}

TEST_F(DamagedMemory, WhatIsNoMemoryIsRefused) {
  folder_.write("memory/memory.sqlite", std::string(8192, 'x'));
  EXPECT_NE(error().find("memory.sqlite"), std::string::npos) << error();
  std::filesystem::remove(folder_ / "memory/memory.sqlite");
  {
    Database other(folder_ / "memory/memory.sqlite", Database::Access::kWrite);
    other.execute("CREATE TABLE topics(id INTEGER)");
  }
  EXPECT_NE(error().find("is no memory of POCD"), std::string::npos) << error();
}

}  // namespace
}  // namespace pocd::test
