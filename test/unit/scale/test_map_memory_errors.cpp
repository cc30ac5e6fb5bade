// The disk under a map with a memory budget fails: what is lost, and who hears of it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>

#include "map_fixtures.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_io.hpp"
#include "pocd/map/map_reader.hpp"
#include "pocd/map/map_replica.hpp"
#include "scratch_folder.hpp"

namespace pocd::testing {
namespace {

TsdfConfig limited(const std::string& folder) {
  TsdfConfig config = coarse_config();
  config.memory.limit = MapLimit::kBudget;
  config.memory.budget_mb = 3;
  config.memory.folder = folder;
  return config;
}

View at(double x) { return look({2.5, {}}, camera_pose({x, 0.0, 1.0}, 0.0, 0.0)); }

void drive(TsdfMap& map, double from_m, double to_m) {
  ThreadPool pool(1);
  const double step = from_m < to_m ? 0.6 : -0.6;
  for (int i = 0; i <= std::lround((to_m - from_m) / step); ++i) {
    map.integrate(at(from_m + step * i).input(), pool);
  }
}

/// Turns over every byte of the files without a name that this process has open in the folder.
int damage_files_in(const std::string& folder) {
  int damaged = 0;
  for (int fd = 3; fd < 256; ++fd) {
    const std::string link = "/proc/self/fd/" + std::to_string(fd);
    std::error_code none;
    const std::string target = std::filesystem::read_symlink(link, none).string();
    if (target.rfind(folder, 0) != 0) continue;
    struct stat info {};
    if (::fstat(fd, &info) != 0) continue;
    std::vector<char> bytes(static_cast<std::size_t>(info.st_size));
    EXPECT_EQ(::pread(fd, bytes.data(), bytes.size(), 0), info.st_size);
    for (char& b : bytes) b = static_cast<char>(~b);
    EXPECT_EQ(::pwrite(fd, bytes.data(), bytes.size(), 0), info.st_size);
    ++damaged;
  }
  return damaged;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(MapMemoryErrors, FolderThatIsNoneIsNamed) {
  try {
    TsdfMap map(limited("/nowhere/at all"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_PRED2(contains, error.what(), "map.memory.folder");
    EXPECT_PRED2(contains, error.what(), "/nowhere/at all");
    EXPECT_PRED2(contains, error.what(), "No such file");
  }
}

TEST(MapMemoryErrors, DamagedPagesCostTheirBlocksOnly) {
  const ScratchFolder folder;
  TsdfMap map(limited(folder.path().string())), whole(coarse_config());
  drive(map, 0.0, 40.0);
  drive(whole, 0.0, 40.0);
  MapPublisher publisher(1, map.config());
  MapReplica copy;
  copy.apply(*publisher.update(map));
  const std::uint64_t on_disk = map.memory_status().blocks_on_disk;
  ASSERT_GT(on_disk, 0u);
  ASSERT_EQ(damage_files_in(folder.path().string()), 1);
  EXPECT_THROW(save_map(map, folder / "map"), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_FALSE(map.take_problem()) << "reading alone loses nothing";

  // Back to where everything is on disk. Nothing throws.
  drive(map, 40.0, 0.0);
  const MapMemoryStatus status = map.memory_status();
  EXPECT_GT(status.blocks_lost, 0u);
  EXPECT_LE(status.blocks_lost, on_disk);
  const auto problem = map.take_problem();
  ASSERT_TRUE(problem);
  EXPECT_PRED2(contains, *problem, "the checksum does not fit");
  EXPECT_PRED2(contains, *problem, "are lost");
  EXPECT_FALSE(map.take_problem()) << "said once";

  // Copies lose it too, and are in step; what is left is as good as a fresh publication.
  for (int i = 0; i < 3; ++i) {
    if (const auto delta = publisher.update(map)) {
      EXPECT_EQ(copy.apply(*delta), DeltaOutcome::kApplied);
    }
  }
  EXPECT_TRUE(copy.current());
  MapReader reader(map);
  std::size_t same = 0, blocks = 0;
  for (const BlockKey& key : map.sorted_keys()) {
    const VoxelBlock* block = nullptr;
    ASSERT_NO_THROW(block = reader.find(key));
    ++blocks;
    same += whole.find(key) && whole.find(key)->tsdf == block->tsdf;
  }
  EXPECT_EQ(blocks, map.block_count());
  EXPECT_GT(same, 0u);
}

// A region that was lost and filled anew holds nothing of the object that it once held.
TEST(MapMemoryErrors, LostRegionsAreNobodysAnyMore) {
  const ScratchFolder folder;
  TsdfMap map(limited(folder.path().string()));
  ThreadPool pool(1);
  for (int i = 0; i <= 67; ++i) {
    View view = at(0.6 * i);
    std::fill(view.owners.begin(), view.owners.end(), 7u);
    map.integrate(view.input(), pool);
  }
  ASSERT_EQ(damage_files_in(folder.path().string()), 1);
  drive(map, 40.0, 0.0);
  drive(map, 0.0, 40.0);
  ASSERT_GT(map.memory_status().blocks_lost, 0u);
  map.clear_object(ObjectId{7});
  drive(map, 40.0, 0.0);
  drive(map, 0.0, 40.0);
  const std::uint64_t returns = map.memory_status().returns;
  EXPECT_EQ(map.clear_object(ObjectId{7}), 0u);
  EXPECT_EQ(map.memory_status().returns, returns) << "nothing of it is on disk";
}

TEST(MapMemoryErrors, PublicationOutlivesADamagedPage) {
  const ScratchFolder folder;
  TsdfMap map(limited(folder.path().string()));
  drive(map, 0.0, 40.0);  // dirty, never published, mostly on disk
  const std::size_t before = map.block_count();
  ASSERT_EQ(damage_files_in(folder.path().string()), 1);
  MapPublisher publisher(1, map.config());
  EXPECT_TRUE(publisher.update(map));
  publisher.update(map);
  const std::uint64_t lost = map.memory_status().blocks_lost;
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(map.block_count() + lost, before);
  EXPECT_EQ(map.memory_status().blocks_on_disk, 0u);
  for (const BlockKey& key : map.sorted_keys()) map.touch(key);
  MapPublisher fresh(1, map.config());
  fresh.update(map);
  EXPECT_EQ(publisher.digest(), fresh.digest());
}

TEST(MapMemoryErrors, FullDiskLosesNothing) {
  const ScratchFolder folder;
  TsdfMap map(limited(folder.path().string())), whole(coarse_config());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit tight = before;
  tight.rlim_cur = 4096;  // one small page
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  drive(map, 0.0, 40.0);
  drive(map, 40.0, 0.0);
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  drive(whole, 0.0, 40.0);
  drive(whole, 40.0, 0.0);

  const MapMemoryStatus status = map.memory_status();
  EXPECT_GT(status.write_failures, 0u);
  EXPECT_GT(status.frames_over_budget, 0u);
  EXPECT_EQ(status.blocks_lost, 0u);
  const auto problem = map.take_problem();
  ASSERT_TRUE(problem);
  EXPECT_PRED2(contains, *problem, "cannot be written");
  EXPECT_PRED2(contains, *problem, folder.path().string());
  MapPublisher a(1, map.config()), b(1, whole.config());
  a.update(map);
  b.update(whole);
  EXPECT_EQ(a.digest(), b.digest());
  // Room again: the map finds back into its budget.
  drive(map, 0.0, 6.0);
  EXPECT_LE(map.memory_status().memory_bytes, map.memory_status().budget_bytes);
}

}  // namespace
}  // namespace pocd::testing
