// A recorder that is killed, a disk that fills up, a recording in parts.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "pocd/common/check.hpp"
#include "pocd/recording/split_writer.hpp"
#include "recordings.hpp"

namespace pocd::recording {
namespace {

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

TEST(KilledRecorder, LeavesAReadableFile) {
  const TemporaryFolder folder;
  Random random(2);
  for (int trial = 0; trial < 10; ++trial) {
    const auto file = folder / ("killed" + std::to_string(trial) + ".mcap");
    const std::uint64_t messages = 50 + random.below(400);
    const int code = in_child([&] {
      McapWriterOptions options;
      options.chunk_bytes = 4000;
      McapWriter writer(file, options);
      const auto channel = writer.add_channel(0, "/a", "cdr", {});
      const Bytes data(500, 7);
      for (std::uint32_t i = 0; i < messages; ++i)
        writer.write({channel, i, i, i}, data.data(), 500);
      ::raise(SIGKILL);
      return 0;
    });
    ASSERT_EQ(code, 128 + SIGKILL);
    const auto reader = open_recording(file);
    EXPECT_TRUE(reader->info().recovered);
    const std::vector<Kept> kept = read_all(*reader);
    // All but the chunk that was being filled: 7 messages of 500 bytes fit in 4000.
    ASSERT_LE(kept.size(), messages);
    EXPECT_GE(kept.size() + 7, messages);
    for (std::size_t i = 0; i < kept.size(); ++i) ASSERT_EQ(kept[i].sequence, i);
  }
}

/// Writes until that fails; 3 when it fails with a clear error and a closed file.
int write_until_full(const std::filesystem::path& file, std::size_t chunk_bytes) {
  McapWriterOptions options;
  options.chunk_bytes = chunk_bytes;
  options.compression = ChunkCompression::kNone;
  McapWriter writer(file, options);
  const auto channel = writer.add_channel(0, "/a", "cdr", {});
  const Bytes data(500, 7);
  try {
    for (std::uint32_t i = 0; i < 10'000; ++i) writer.write({channel, i, i, i}, data.data(), 500);
  } catch (const InputError& error) {
    const std::string what = error.what();
    const bool clear = what.find("full.mcap: ") != std::string::npos &&
                       what.find(" at byte ") != std::string::npos &&
                       what.find("the file is closed and readable") != std::string::npos;
    return clear && !writer.is_open() ? 3 : 4;
  }
  return 5;
}

/// The file is whole, and uses the room there was.
int check_full(const std::filesystem::path& file) {
  const auto reader = open_recording(file);
  const bool whole = !reader->info().recovered && reader->problem_count() == 0 &&
                     read_all(*reader).size() == reader->info().messages;
  const bool used = reader->info().bytes <= 100'000 && reader->info().bytes > 60'000;
  return whole && used ? 3 : 6;
}

TEST(FullDisk, EndsWithAnErrorAndAClosedFile) {
  const TemporaryFolder folder;
  const auto file = folder / "full.mcap";
  // A limit of the file's size stands for the end of the disk where nothing may be mounted.
  const int code = in_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return write_until_full(file, 5000);
  });
  EXPECT_EQ(code, 3);
  EXPECT_EQ(check_full(file), 3);
  try {
    McapWriter writer("/dev/full");
    FAIL() << "/dev/full took a header";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/dev/full: cannot be written at byte 0"),
              std::string::npos);
  }
}

TEST(FullDisk, KeepsRoomForTheIndexOnARealFileSystem) {
  const TemporaryFolder folder;
  const int code = in_child([&] {
    if (::unshare(CLONE_NEWNS) != 0 ||
        ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=98304") != 0) {
      return 77;
    }
    // Chunks so small that the index takes more room than the last of them.
    const int written = write_until_full(folder / "full.mcap", 600);
    return written == 3 ? check_full(folder / "full.mcap") : written;
  });
  if (code == 77) GTEST_SKIP() << "no file system may be mounted here";
  EXPECT_EQ(code, 3);
}

TEST(SplitWriter, SplitsBySizeAndTime) {
  const TemporaryFolder folder;
  for (const bool by_size : {true, false}) {
    const std::string name = by_size ? "size" : "time";
    SplitOptions options;
    options.mcap.chunk_bytes = 2000;
    options.mcap.compression = ChunkCompression::kNone;
    (by_size ? options.most_bytes : options.most_duration_ns) = by_size ? 20'000 : 100;
    SplitWriter writer(folder / (name + ".mcap"), options);
    const auto schema = writer.add_schema("a", "ros2msg", "uint8 a\n");
    const auto a = writer.add_channel(schema, "/a", "cdr", {{"k", "v"}});
    const Bytes data(300, 1);
    for (std::uint32_t i = 0; i < 500; ++i) {
      writer.write({a, i, 1000 + i, 0}, data.data(), data.size());
      if (i == 250) writer.add_channel(schema, "/late", "cdr", {});
    }
    writer.close();
    EXPECT_GE(writer.files().size(), 5u);
    EXPECT_LE(writer.files().size(), 10u);
    EXPECT_EQ(writer.files()[0].filename(), name + "_0000.mcap");
    std::uint32_t next = 0;
    std::uint64_t bytes = 0;
    for (const auto& file : writer.files()) {
      bytes += std::filesystem::file_size(file);
      const auto reader = open_recording(file);
      EXPECT_EQ(reader->problem_count(), 0u);
      EXPECT_EQ(reader->channels()[0].metadata.at("k"), "v");
      if (by_size) {
        EXPECT_LT(reader->info().bytes, 24'000u);
      } else {
        EXPECT_LT(reader->info().end_ns - reader->info().start_ns, 100u);
      }
      for (const Kept& kept : read_all(*reader)) ASSERT_EQ(kept.sequence, next++);
    }
    EXPECT_EQ(next, 500u);
    EXPECT_EQ(bytes, writer.bytes_written());
  }
}

TEST(SplitWriter, EveryFileBeginsWithTheHead) {
  const TemporaryFolder folder;
  SplitOptions options;
  options.most_bytes = 5'000;
  options.mcap.chunk_bytes = 500;
  options.mcap.compression = ChunkCompression::kNone;
  EXPECT_TRUE(SplitWriter::existing(folder / "run.mcap", options).empty());
  SplitWriter writer(folder / "run.mcap", options);
  const auto schema = writer.add_schema("a", "ros2msg", "uint8 a\n");
  const auto latched = writer.add_channel(schema, "/latched", "cdr", {});
  const auto a = writer.add_channel(schema, "/a", "cdr", {});
  const Bytes large(20'000, 2), data(300, 1);
  writer.set_head([&](const SplitWriter::Write& write) {
    write({latched, 7, 5, 6}, large.data(), 20'000);
  });
  for (std::uint32_t i = 0; i < 50; ++i) writer.write({a, i, 1000 + i, 0}, data.data(), 300);
  writer.close();
  ASSERT_GE(writer.files().size(), 3u);
  EXPECT_LE(writer.files().size(), 5u) << "a head that is larger than a file is no reason to split";
  for (std::size_t i = 1; i < writer.files().size(); ++i) {
    const auto kept = read_all(*open_recording(writer.files()[i]));
    ASSERT_GE(kept.size(), 2u);
    EXPECT_EQ(kept[0].topic, "/latched");
    EXPECT_EQ(kept[0].data, large);
    EXPECT_EQ(kept[0].log_time_ns, kept[1].log_time_ns) << "no pause in a replay";
  }
  EXPECT_EQ(SplitWriter::existing(folder / "run.mcap", options), writer.files());
}

// The last hours of a robot, whatever happened to the recorder meanwhile.
TEST(SplitWriter, ARingNamesWhatItCannotRemoveAndGoesOn) {
  const TemporaryFolder folder;
  SplitOptions options;
  options.mcap.chunk_bytes = 500;
  options.mcap.compression = ChunkCompression::kNone;
  options.most_bytes = 5'000;
  options.keep_bytes = 15'000;
  std::filesystem::create_directories(folder / "run_0000.mcap" / "full");  // no file of a recorder
  SplitWriter writer(folder / "run.mcap", options);
  const auto schema = writer.add_schema("a", "ros2msg", "uint8 a\n");
  const auto a = writer.add_channel(schema, "/a", "cdr", {});
  const Bytes data(300, 1);
  EXPECT_EQ(writer.problem(), "");
  for (std::uint32_t i = 0; i < 200; ++i) writer.write({a, i, 1000 + i, 0}, data.data(), 300);
  writer.close();
  EXPECT_NE(writer.problem().find("run_0000.mcap: cannot be removed"), std::string::npos)
      << writer.problem();
  EXPECT_TRUE(std::filesystem::exists(folder / "run_0000.mcap" / "full"));
  EXPECT_EQ(read_all(*open_recording(writer.files().back())).back().log_time_ns, 1199u);
}

TEST(SplitWriter, ARingKeepsTheLatestAlsoOverRuns) {
  const TemporaryFolder folder;
  SplitOptions options;
  options.mcap.chunk_bytes = 500;
  options.mcap.compression = ChunkCompression::kNone;
  options.most_bytes = 5'000;
  options.keep_bytes = 30'000;
  std::ofstream(folder / "run_notes.mcap") << "not of the ring";
  std::ofstream(folder / "run_12.mcap") << "not of the ring";
  const Bytes data(300, 1);
  const auto held = [&] {
    std::map<std::string, std::uintmax_t> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      if (entry.path().stem().string().size() == 8) {
        files[entry.path().filename().string()] = entry.file_size();
      }
    }
    return files;
  };
  std::uint32_t sent = 0;
  for (int run = 0; run < 3; ++run) {
    SplitWriter writer(folder / "run.mcap", options);
    const auto schema = writer.add_schema("a", "ros2msg", "uint8 a\n");
    const auto a = writer.add_channel(schema, "/a", "cdr", {});
    for (int i = 0; i < 200; ++i, ++sent) {
      writer.write({a, sent, 1000 + sent, 0}, data.data(), 300);
      std::uintmax_t bytes = 0;
      for (const auto& [name, size] : held()) bytes += size;
      ASSERT_LE(bytes, options.keep_bytes + options.most_bytes) << "message " << sent;
    }
    writer.close();
    const auto files = held();
    EXPECT_EQ(files.size(), writer.files().size());
    EXPECT_GE(files.size(), 4u) << "it keeps what there is room for";
    EXPECT_FALSE(std::filesystem::exists(folder / "metadata.yaml"));
    // Without a gap, up to the newest, also over the ends of runs.
    std::uint32_t next = 0;
    std::uintmax_t bytes = 0;
    for (const auto& [name, size] : files) {
      bytes += size;
      for (const Kept& kept : read_all(*open_recording(folder / name))) {
        if (next != 0) {
          ASSERT_EQ(kept.sequence, next) << name;
        }
        next = kept.sequence + 1;
      }
    }
    EXPECT_EQ(next, sent + 0u);
    EXPECT_EQ(bytes, writer.bytes_written());
    EXPECT_LE(bytes, options.keep_bytes + 2'000) << "closed, with its summary";
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "run_notes.mcap"));
  EXPECT_TRUE(std::filesystem::exists(folder / "run_12.mcap"));
}

}  // namespace
}  // namespace pocd::recording
