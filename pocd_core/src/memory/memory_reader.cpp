#include "pocd/memory/memory_reader.hpp"

#include <cstdlib>
#include <limits>
#include <system_error>
#include <utility>

#include "../map/zstd_codec.hpp"
#include "folder_lock.hpp"
#include "loader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_io.hpp"
#include "pocd/map/map_replica.hpp"
#include "schema.hpp"
#include "voxel_page.hpp"

namespace pocd {

using namespace memory;

struct MemoryReader::Impl {
  explicit Impl(const std::filesystem::path& f)
      : folder(f), file(f / kFileName), database(file, Database::Access::kRead) {
    const auto known = read_head(database);
    if (!known) throw InputError(file.string() + ": is empty");
    head = *known;
  }
  std::vector<LoggedEvent> take(Statement& rows, std::size_t most);

  std::filesystem::path folder, file;
  Database database;
  FileHead head;
  std::uint64_t damaged = 0;
};

namespace {

/// What SQLite says, as an error of the user's data.
template <class Body>
auto reading(const Body& body) {
  try {
    return body();
  } catch (const DatabaseError& error) {
    throw InputError(error.what());
  }
}

std::uint64_t file_bytes(const std::filesystem::path& file) {
  std::uint64_t bytes = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code error;
    std::filesystem::path part = file;
    part += suffix;
    const auto size = std::filesystem::file_size(part, error);
    if (!error) bytes += size;
  }
  return bytes;
}

}  // namespace

MemoryReader::MemoryReader(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / kFileName)) {
    throw InputError(folder.string() + ": holds no memory (" + kFileName + " is missing)");
  }
  impl_ = reading([&] { return std::make_unique<Impl>(folder); });
}
MemoryReader::~MemoryReader() = default;

std::uint64_t MemoryReader::damaged_events() const { return impl_->damaged; }

// Rows of seq, run, sum, data.
std::vector<LoggedEvent> MemoryReader::Impl::take(Statement& rows, std::size_t most) {
  std::vector<LoggedEvent> list;
  while (list.size() < most && rows.step()) {
    const auto seq = static_cast<std::uint64_t>(rows.integer(0));
    const std::vector<std::uint8_t> data = rows.blob(3);
    LoggedEvent logged;
    logged.run = rows.integer(1);
    try {
      if (row_sum(seq, data.data(), data.size()) != static_cast<std::uint64_t>(rows.integer(2))) {
        throw InputError("is damaged");
      }
      unarchive(data, "event", logged.event);
    } catch (const InputError&) {
      ++damaged;
      continue;
    }
    list.push_back(std::move(logged));
  }
  return list;
}

std::vector<LoggedEvent> MemoryReader::events(std::uint64_t after, std::size_t most) {
  if (after >= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return {};
  return reading([&] {
    Statement rows(impl_->database,
                   "SELECT seq, run, sum, data FROM events WHERE seq > ?1 ORDER BY seq");
    rows.bind(1, static_cast<std::int64_t>(after));
    return impl_->take(rows, most);
  });
}

std::vector<LoggedEvent> MemoryReader::standing() {
  return reading([&] {
    Statement rows(impl_->database, "SELECT seq, run, sum, data FROM standing ORDER BY object");
    return impl_->take(rows, std::numeric_limits<std::size_t>::max());
  });
}

std::map<ClassId, std::string> MemoryReader::class_names() {
  return reading([&] {
    std::map<ClassId, std::string> names;
    Statement rows(impl_->database, "SELECT id, name FROM classes");
    while (rows.step()) names[static_cast<ClassId>(rows.integer(0))] = rows.text(1);
    return names;
  });
}

std::vector<std::pair<BlockKey, StampNs>> MemoryReader::last_looks() {
  return reading([&] {
    std::vector<std::pair<BlockKey, StampNs>> looks;
    const auto damaged = [](const std::string& what) { throw InputError(what); };
    read_rows(
        impl_->database, kRegionsTable,
        [&](std::int64_t key, std::vector<std::uint8_t> data) {
          StampNs stamp_ns = 0;
          unarchive(decompress(data.data(), data.size(), sizeof stamp_ns, "region"), "region",
                    stamp_ns);
          looks.emplace_back(block_key(static_cast<std::uint64_t>(key)), stamp_ns);
        },
        damaged);
    return looks;
  });
}

std::vector<MapTile> MemoryReader::tiles(std::vector<std::string>& damage) {
  return reading([&] {
    std::vector<MapTile> tiles;
    const auto damaged = [&](const std::string& what) { damage.push_back(what); };
    read_rows(
        impl_->database, kTiles,
        [&](std::int64_t key, std::vector<std::uint8_t> data) {
          try {
            tiles.push_back(tile_row(key, std::move(data), "tile"));
          } catch (const InputError& error) {
            damaged(error.what());
          }
        },
        damaged);
    return tiles;
  });
}

std::vector<LoggedRun> MemoryReader::runs() {
  return reading([&] {
    std::vector<LoggedRun> list;
    Statement rows(impl_->database,
                   "SELECT run, epoch, program, started_ns, first_event, ended FROM runs "
                   "ORDER BY run");
    while (rows.step()) {
      list.push_back({rows.integer(0), std::strtoull(rows.text(1).c_str(), nullptr, 16),
                      rows.text(2), rows.integer(3), static_cast<std::uint64_t>(rows.integer(4)),
                      rows.integer(5) != 0});
    }
    return list;
  });
}

std::pair<std::uint64_t, std::uint64_t> MemoryReader::range() {
  return reading([&] {
    // One aggregate each: SQLite finds either end without reading what is between.
    const auto end = [&](const char* which) {
      return static_cast<std::uint64_t>(
          impl_->database.number(std::string("SELECT ifnull(") + which + "(seq), 0) FROM events"));
    };
    return std::pair(end("min"), end("max"));
  });
}

std::uint64_t MemoryReader::lineage() const { return impl_->head.lineage; }

MemoryInfo MemoryReader::info() {
  return reading([&] {
    Database& db = impl_->database;
    db.execute("BEGIN");  // one point in time
    MemoryInfo info;
    try {
      info.lineage = impl_->head.lineage;
      info.file_version = kFileVersion;
      info.voxel_size_m = impl_->head.voxel_size_m;
      info.truncation_voxels = impl_->head.truncation_voxels;
      info.min_publish_weight = impl_->head.min_publish_weight;
      if (const auto state = read_state(db)) {
        info.steps = state->step;
        info.ended_clean = state->clean;
        info.stamp_ns = state->stamp_ns;
        info.map_version = state->map_version;
        info.digest = state->digest;
        info.objects = state->totals[kObjects].rows;
        info.free_blocks = state->totals[kFreeSpaceTable].rows;
        info.tiles = state->totals[kTiles].rows;
        info.voxel_tiles = state->totals[kVoxels].rows;
        info.event_bytes = state->event_bytes;
      }
      Statement log(db, "SELECT ifnull(min(seq), 0), ifnull(max(seq), 0), count(*) FROM events");
      log.step();
      info.first_event = static_cast<std::uint64_t>(log.integer(0));
      info.last_event = static_cast<std::uint64_t>(log.integer(1));
      info.events = static_cast<std::uint64_t>(log.integer(2));
      info.runs = runs();
      info.file_bytes = file_bytes(impl_->file);
    } catch (...) {
      db.execute("ROLLBACK");
      throw;
    }
    db.execute("COMMIT");
    return info;
  });
}

std::vector<std::string> MemoryReader::verify() {
  std::vector<std::string> wrong;
  const auto damaged = [&](const std::string& reason) { wrong.push_back(reason); };
  Database& db = impl_->database;
  try {
    db.execute("BEGIN");
    Statement pages(db, "PRAGMA integrity_check(20)");
    while (pages.step()) {
      if (pages.text(0) != "ok") damaged(db.name() + ": " + pages.text(0));
    }
    const auto state = read_state(db);
    if (!state) {
      db.execute("COMMIT");
      return wrong;
    }
    MapDigest digest;
    try {
      const Loaded loaded = load(db, *state);
      digest = map_digest(loaded.tiles);
      if (digest != state->digest) {
        damaged(db.name() + ": tiles have digest " + digest.hex() + ", noted is " +
                state->digest.hex());
      }
      const VoxelsOf voxels(db);
      for (const StoredRegion& region : loaded.regions) {
        try {
          if (voxels.read(region.key).size() != region.present.count()) {
            damaged(db.name() + ": a region has other blocks than its index");
          }
        } catch (const InputError& error) {
          damaged(error.what());
        }
      }
    } catch (const InputError& error) {
      damaged(error.what());
    }
    const std::uint64_t before = impl_->damaged;
    Statement log(db, "SELECT seq, run, sum, data FROM events ORDER BY seq");
    impl_->take(log, std::numeric_limits<std::size_t>::max());
    if (impl_->damaged > before) {
      damaged(db.name() + ": " + std::to_string(impl_->damaged - before) + " damaged events");
    }
    log.reset();
    db.execute("COMMIT");
  } catch (const std::exception& error) {
    damaged(error.what());
    sqlite3_exec(db.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
  return wrong;
}

void MemoryReader::export_map(const std::filesystem::path& file) {
  reading([&] {
    Database& db = impl_->database;
    db.execute("BEGIN");
    try {
      TsdfConfig config;
      config.voxel_size_m = impl_->head.voxel_size_m;
      config.truncation_voxels = impl_->head.truncation_voxels;
      TsdfMap map(config);
      if (const auto state = read_state(db)) {
        map.restore(load(db, *state).regions, std::make_shared<VoxelsOf>(db));
      }
      save_map(map, file);
    } catch (...) {
      sqlite3_exec(db.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
      throw;
    }
    db.execute("COMMIT");
  });
}

void MemoryReader::backup(const std::filesystem::path& folder) {
  const FolderLock lock(folder);
  const std::filesystem::path file = folder / kFileName;
  if (std::filesystem::exists(file)) throw InputError(file.string() + ": is there already");
  std::filesystem::path unfinished = file;
  unfinished += ".part";
  std::error_code error;
  std::filesystem::remove(unfinished, error);
  reading([&] {
    Statement copy(impl_->database, "VACUUM INTO ?1");
    copy.bind_text(1, unfinished.string()).run();
  });
  std::filesystem::rename(unfinished, file, error);
  if (error) throw InputError(file.string() + ": " + error.message());
}

void compact_memory(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / kFileName)) {
    throw InputError(folder.string() + ": holds no memory (" + kFileName + " is missing)");
  }
  const FolderLock lock(folder);
  reading([&] {
    Database database(folder / kFileName, Database::Access::kWrite);
    if (!read_head(database)) throw InputError(database.name() + ": is empty");
    database.execute("VACUUM; PRAGMA wal_checkpoint(TRUNCATE)");
  });
}

}  // namespace pocd
