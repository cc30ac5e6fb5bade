// Folders that are in use, full, read-only, of another version or another map; retention; restarts.
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <sched.h>
#include <csignal>

#include "memory/database.hpp"
#include "memory/schema.hpp"
#include "memory_run.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"

namespace pocd::test {
namespace {

std::string error_of(const std::filesystem::path& folder, const TsdfConfig& map) {
  MemoryConfig config;
  config.folder = folder.string();
  try {
    WarehouseMemory memory(config, map);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void expect_error(const std::filesystem::path& folder, const std::string& words,
                  const TsdfConfig& map = circuit_config().map) {
  const std::string error = error_of(folder, map);
  EXPECT_NE(error.find(words), std::string::npos) << error;
  EXPECT_NE(error.find(folder.filename().string()), std::string::npos) << error;
}

/// A memory of the first frames.
void make_memory(const std::filesystem::path& folder, int frames = 20) {
  MemoryRunner run(circuit_config(), folder);
  for (int i = 0; i < frames; ++i) run.process(small_frames());
  ASSERT_TRUE(run.finish());
}

/// Runs `body` in a process of its own; its exit code, or 128 + signal.
template <class Body>
int in_child(Body body) {
  const pid_t child = ::fork();
  if (child == 0) {
    int code = 99;
    try {
      code = body();
    } catch (...) {
    }
    ::_exit(code);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(WarehouseMemory, IsOfOneProcessAtATime) {
  const ScratchFolder folder;
  const MemoryRunner run(circuit_config(), folder / "memory");
  expect_error(folder / "memory", "is in use by process " + std::to_string(::getpid()));
}

TEST(WarehouseMemory, AFileOfAnotherVersionIsRefusedByNumber) {
  const ScratchFolder folder;
  make_memory(folder / "memory");
  {
    memory::Database database(folder / "memory/memory.sqlite", memory::Database::Access::kWrite);
    database.execute("PRAGMA user_version = 9");
  }
  expect_error(folder / "memory", "memory of version 9, this program knows version 3");
}

TEST(WarehouseMemory, StatesOfAnotherPipelineAreRefusedByNumber) {
  const ScratchFolder folder;
  make_memory(folder / "memory");
  {
    memory::Database database(folder / "memory/memory.sqlite", memory::Database::Access::kWrite);
    database.execute("UPDATE meta SET value = '77' WHERE name = 'pieces_version'");
  }
  expect_error(folder / "memory", "state of the pipeline of version 77, this program knows");
}

TEST(WarehouseMemory, AnotherKindOfMapIsRefusedByName) {
  const ScratchFolder folder;
  make_memory(folder / "memory");
  TsdfConfig map = circuit_config().map;
  map.voxel_size_m *= 2.0;
  expect_error(folder / "memory", "voxel_size_m", map);
  map = circuit_config().map;
  map.truncation_voxels += 1.0;
  expect_error(folder / "memory", "truncation_voxels", map);
  map = circuit_config().map;
  ++map.min_publish_weight;
  expect_error(folder / "memory", "min_publish_weight", map);
}

TEST(WarehouseMemory, AFolderThatCannotBeMadeIsNamed) {
  const ScratchFolder folder;
  folder.write("file", "x");
  EXPECT_NE(error_of(folder / "file/memory", circuit_config().map).find("file/memory"),
            std::string::npos);
}

TEST(WarehouseMemory, NumbersThatMayHaveBeenUsedAreNotUsedAgain) {
  const ScratchFolder folder;
  PocdPipeline::Numbers next;
  {
    MemoryRunner run(circuit_config(), folder / "memory");
    for (int i = 0; i < 20; ++i) run.process(small_frames());
    run.step();
    for (int i = 0; i < 20; ++i) run.process(small_frames());
    next = run.pipeline().numbers();
  }  // not in order
  MemoryRunner run(circuit_config(), folder / "memory");
  EXPECT_FALSE(run.memory().ended_clean());
  EXPECT_LT(run.pipeline().numbers().object, next.object);
  run.pipeline().skip_to(run.memory().reserved());
  EXPECT_GE(run.pipeline().numbers().object, next.object);
  EXPECT_GE(run.pipeline().numbers().event, next.event);
}

TEST(WarehouseMemory, TheLogKeepsWhatItIsToldAndWhereThingsStood) {
  const ScratchFolder folder;
  MemoryConfig keep;
  keep.keep_events_days = 2.0 / 86400.0;
  {
    MemoryRunner run(circuit_config(), folder / "memory", keep);
    for (int n = 0; run.process(small_frames()); ++n) {
      if (n % 5 == 0) run.step();
    }
    ASSERT_TRUE(run.finish());
    MemoryReader log(folder / "memory");
    const std::vector<LoggedEvent> kept = log.events(0, 100000);
    const StampNs newest_ns = small_frames().back().stamp_ns;
    std::size_t young = 0;
    for (const ObjectEvent& e : run.events()) young += newest_ns - e.stamp_ns <= 2'000'000'000;
    EXPECT_EQ(kept.size(), young);
    EXPECT_LT(young, run.events().size());
    // What stands is what all events say, whether they are kept or not.
    std::map<ObjectId, std::string> expected, found;
    const auto tell = [](std::map<ObjectId, std::string>& all, const ObjectEvent& e) {
      if (e.absorbed) all.erase(*e.absorbed);
      if (e.kind == EventKind::kRemoved) {
        all.erase(e.object);
      } else {
        all[e.object] = line(e);
      }
    };
    for (const ObjectEvent& e : run.events()) tell(expected, e);
    for (const LoggedEvent& e : log.standing()) tell(found, e.event);
    for (const LoggedEvent& e : kept) tell(found, e.event);
    EXPECT_EQ(found, expected);
    EXPECT_FALSE(log.standing().empty());
  }
}

TEST(WarehouseMemory, CopiesAreMemoriesToo) {
  const ScratchFolder folder;
  MemoryRunner run(circuit_config(), folder / "memory");
  for (int i = 0; i < 30; ++i) run.process(small_frames());
  run.step();
  run.step();  // waits for the one before
  MemoryReader(folder / "memory").backup(folder / "copy");
  EXPECT_THROW(MemoryReader(folder / "memory").backup(folder / "copy"), InputError);
  MemoryReader copy(folder / "copy");
  EXPECT_TRUE(copy.verify().empty());
  EXPECT_EQ(copy.info().digest, run.publisher().digest());
  MemoryRunner second(circuit_config(), folder / "copy");
  EXPECT_EQ(second.next(), 30u);
  EXPECT_EQ(second.memory().lineage(), run.memory().lineage());
}

TEST(WarehouseMemory, IsSmallerAfterItWasCompacted) {
  const ScratchFolder folder;
  make_memory(folder / "memory", 60);
  {
    memory::Database database(folder / "memory/memory.sqlite", memory::Database::Access::kWrite);
    database.execute(
        "CREATE TABLE room(data BLOB); INSERT INTO room VALUES(zeroblob(3000000));"
        "DROP TABLE room; PRAGMA wal_checkpoint(TRUNCATE)");
  }
  const auto before = std::filesystem::file_size(folder / "memory/memory.sqlite");
  compact_memory(folder / "memory");
  EXPECT_LT(std::filesystem::file_size(folder / "memory/memory.sqlite") + 2'500'000, before);
  EXPECT_TRUE(MemoryReader(folder / "memory").verify().empty());
}

// The disk is a small file system of its own, which needs the right to mount one.
TEST(WarehouseMemory, AFullDiskHoldsNothingUpAndIsMadeUpFor) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "disk");
  const int code = in_child([&] {
    if (::unshare(CLONE_NEWNS) != 0) return 77;
    ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (::mount("tmpfs", (folder / "disk").c_str(), "tmpfs", 0, "size=1500k") != 0) return 77;
    const std::string ballast = (folder / "disk/ballast").string();
    MemoryConfig keep;
    keep.period_s = 0.0;
    MemoryRunner run(circuit_config(), folder / "disk/memory", keep);
    bool failed = false;
    std::ofstream(ballast, std::ios::binary) << std::string(1'000'000, 'x');
    for (int n = 0; n < 60 && run.process(small_frames()); ++n) {
      run.publish();
      if (run.memory().due()) run.step();
      failed |= run.memory().status().failures > 0;
    }
    for (int n = 0; n < 100 && !failed; ++n) {
      ::usleep(20'000);
      failed = run.memory().status().failures > 0;
    }
    if (!failed) return 1;
    const MemoryStatus full = run.memory().status();
    if (full.stopped || full.problem.find("full") == std::string::npos) return 2;
    // What was there before is whole.
    if (MemoryReader(folder / "disk/memory").verify().size() > 0) return 3;
    std::filesystem::remove(ballast);
    if (::mount("tmpfs", (folder / "disk").c_str(), "tmpfs", MS_REMOUNT, "size=60m") != 0) return 4;
    if (!run.finish()) return 5;
    MemoryReader after(folder / "disk/memory");
    if (!after.verify().empty()) return 6;
    if (after.info().digest != run.publisher().digest()) return 7;
    return after.events(0, 100000).size() == run.events().size() ? 0 : 8;
  });
  if (code == 77) GTEST_SKIP() << "file systems cannot be mounted here";
  EXPECT_EQ(code, 0);
}

TEST(WarehouseMemory, AFolderThatIsReadOnlyIsNamed) {
  const ScratchFolder folder;
  make_memory(folder / "memory");
  const int code = in_child([&] {
    if (::unshare(CLONE_NEWNS) != 0) return 77;
    ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    const std::string path = (folder / "memory").string();
    if (::mount(path.c_str(), path.c_str(), nullptr, MS_BIND, nullptr) != 0) return 77;
    if (::mount(nullptr, path.c_str(), nullptr, MS_BIND | MS_REMOUNT | MS_RDONLY, nullptr) != 0) {
      return 77;
    }
    const std::string error = error_of(folder / "memory", circuit_config().map);
    return error.find("cannot be written: Read-only file system") != std::string::npos ? 0 : 1;
  });
  if (code == 77) GTEST_SKIP() << "file systems cannot be mounted here";
  EXPECT_EQ(code, 0);
}

/// Floor and racks over so much ground [m2], in voxels of 5 cm, with some noise.
void build_halls(TsdfMap& map, double area_m2) {
  const int side = static_cast<int>(std::sqrt(area_m2) / 0.4);
  Random random(3);
  const auto fill = [&](const BlockKey& key, bool wall) {
    VoxelBlock& block = map.touch(key);
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const double across = wall ? (i & 7) - 3.3 : (i >> 6) - 3.3;
      const double noisy = across / 4.0 * 32767.0 + static_cast<double>(random.below(400));
      block.tsdf[i] = static_cast<std::int16_t>(std::clamp(noisy, -32767.0, 32767.0));
      block.weight[i] = static_cast<std::uint16_t>(20 + random.below(8));
    }
  };
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      fill({x, y, 0}, false);
      for (int z = 1; x % 8 == 0 && z < 8; ++z) fill({x, y, z}, true);
    }
  }
}

TEST(WarehouseMemory, LooksAreNotedOnlyForAMemory) {
  MemoryRunner without(circuit_config());
  ASSERT_TRUE(without.process(small_frames()));
  EXPECT_TRUE(without.pipeline().looks().empty());
  EXPECT_TRUE(without.pipeline().take_looks().empty());
  const ScratchFolder folder;
  {
    MemoryRunner run(circuit_config(), folder / "memory");
    ASSERT_TRUE(run.process(small_frames()));
    const auto fresh = run.pipeline().take_looks();
    EXPECT_FALSE(fresh.empty());
    EXPECT_EQ(fresh.size(), run.pipeline().looks().size());
    EXPECT_TRUE(run.pipeline().take_looks().empty());
    for (const RegionLook& look : fresh) EXPECT_EQ(look.stamp_ns, small_frames()[0].stamp_ns);
    ASSERT_TRUE(run.finish());
  }
  MemoryRunner again(circuit_config(), folder / "memory");
  EXPECT_TRUE(again.pipeline().take_looks().empty()) << "nobody has looked in this run";
  EXPECT_EQ(again.pipeline().looks().size(), MemoryReader(folder / "memory").last_looks().size());
}

/// The first frames of a room with a box, of robots of its own, in a row of rooms beside the
/// halls.
std::vector<Frame> room_frames(int room, int rooms) {
  constexpr std::size_t kFrames = 36;  // until one of the boxes is known
  constexpr double kRoom_m = 6.4;
  const int per_row = std::max(1, static_cast<int>(std::sqrt(rooms)));
  const StampNs span_ns = small_frames()[kFrames].stamp_ns;
  std::vector<Frame> frames(small_frames().begin(), small_frames().begin() + kFrames);
  for (Frame& frame : frames) {
    frame.robot += "_" + std::to_string(room);
    frame.stamp_ns += span_ns * room;
    frame.T_W_C.translation().x() += kRoom_m * (room % per_row);
    frame.T_W_C.translation().y() -= kRoom_m * (room / per_row + 1);
  }
  return frames;
}

// POCD_AREA_M2: how much ground; for a large one by hand (POCD_KEEP_MEMORY: a folder in which it is
// kept). Of that, up to 10 000 m2 are rooms with objects and free space, as robots have seen them.
TEST(WarehouseMemory, ALargePlaceIsThereSoon) {
  const char* text = std::getenv("POCD_AREA_M2");
  const double area_m2 = text != nullptr ? std::atof(text) : 500.0;
  const int rooms = static_cast<int>(std::min(area_m2, 10000.0) / 40.0);
  const ScratchFolder scratch;
  const char* kept = std::getenv("POCD_KEEP_MEMORY");
  const std::filesystem::path folder = kept != nullptr ? kept : scratch / "memory";
  std::uint64_t tiles = 0;
  std::size_t objects = 0;
  {
    MemoryRunner run(circuit_config(), folder);
    build_halls(run.pipeline().map(), area_m2);
    for (int room = 0; room < rooms; ++room) {
      for (const Frame& frame : room_frames(room, rooms)) run.process(frame);
    }
    ASSERT_TRUE(run.finish());
    tiles = run.publisher().tiles().size();
    objects = run.pipeline().objects().size();
    EXPECT_GE(objects, static_cast<std::size_t>(rooms));
  }
  Frame frame = room_frames(rooms / 2, rooms).back();
  frame.stamp_ns = room_frames(rooms, rooms).back().stamp_ns;
  const auto start = std::chrono::steady_clock::now();
  const auto since_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  MemoryRunner again(circuit_config(), folder);
  const double restored_s = since_s();
  EXPECT_EQ(again.publisher().tiles().size(), tiles);
  EXPECT_EQ(again.pipeline().objects().size(), objects);
  again.process(frame);
  again.publish();
  const double first_s = since_s();
  EXPECT_LT(first_s, std::max(3.0, 1e-4 * area_m2));
  const MemoryInfo info = MemoryReader(folder).info();
  std::printf(
      "%g m2, %llu tiles, %zu objects, %llu blocks of free space, %.1f MB: restored in %.2f s, "
      "first "
      "frame published after %.2f s\n",
      area_m2, static_cast<unsigned long long>(tiles), objects,
      static_cast<unsigned long long>(info.free_blocks),
      1e-6 * static_cast<double>(info.file_bytes), restored_s, first_s);
}

}  // namespace
}  // namespace pocd::test
