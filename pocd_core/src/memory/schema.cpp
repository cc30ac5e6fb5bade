#include "schema.hpp"

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "pocd/common/check.hpp"

namespace pocd::memory {
namespace {

// Tables of rows (key, sum, data) have a number as key, which SQLite finds a row by. Voxels and
// what is asked of them before they are read are two tables: the index is read as a whole.
constexpr const char* kTablesSql = R"sql(
  CREATE TABLE meta(name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE state(id INTEGER PRIMARY KEY CHECK(id = 1), sum INTEGER, data BLOB);
  CREATE TABLE parts(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE objects(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE surfaces(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE free_space(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE regions(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE tiles(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE voxel_index(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE voxels(key INTEGER PRIMARY KEY, sum INTEGER, data BLOB);
  CREATE TABLE events(seq INTEGER PRIMARY KEY, stamp_ns INTEGER, object INTEGER, run INTEGER,
                      sum INTEGER, data BLOB);
  CREATE INDEX events_of_object ON events(object);
  CREATE TABLE standing(object INTEGER PRIMARY KEY, seq INTEGER, run INTEGER, sum INTEGER,
                        data BLOB);
  CREATE TABLE classes(id INTEGER PRIMARY KEY, name TEXT NOT NULL);
  CREATE TABLE runs(run INTEGER PRIMARY KEY, epoch TEXT, program TEXT, started_ns INTEGER,
                    first_event INTEGER, ended INTEGER);
)sql";

std::uint64_t random_number() {
  std::random_device device;
  const std::uint64_t number = std::uint64_t{device()} << 32 | device();
  return number == 0 ? 1 : number;
}

std::string hex(std::uint64_t number) {
  char text[24];
  std::snprintf(text, sizeof text, "%016" PRIx64, number);
  return text;
}

std::string exact(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string meta(Database& database, const char* name) {
  Statement statement(database, "SELECT value FROM meta WHERE name = ?1");
  statement.bind_text(1, name);
  if (!statement.step()) throw InputError(database.name() + ": has no " + name);
  return statement.text(0);
}

void put_meta(Database& database, const char* name, const std::string& value) {
  Statement statement(database, "INSERT OR REPLACE INTO meta VALUES(?1, ?2)");
  statement.bind_text(1, name).bind_text(2, value).run();
}

void refuse_other(const std::string& file, const char* what, double stored, double configured) {
  if (stored == configured) return;
  throw InputError(file + ": map with map." + what + " = " + std::to_string(stored) +
                   "; configured is " + std::to_string(configured));
}

}  // namespace

std::optional<FileHead> read_head(Database& database) {
  const std::int64_t application = database.number("PRAGMA application_id");
  const std::int64_t version = database.number("PRAGMA user_version");
  const bool empty = database.number("SELECT count(*) FROM sqlite_master") == 0;
  if (empty && application == 0) return std::nullopt;
  if (application != kApplicationId) throw InputError(database.name() + ": is no memory of POCD");
  if (version != kFileVersion) {
    throw InputError(database.name() + ": memory of version " + std::to_string(version) +
                     ", this program knows version " + std::to_string(kFileVersion));
  }
  const int pieces = std::atoi(meta(database, "pieces_version").c_str());
  if (pieces != kPiecesVersion) {
    throw InputError(database.name() + ": state of the pipeline of version " +
                     std::to_string(pieces) + ", this program knows version " +
                     std::to_string(kPiecesVersion));
  }
  FileHead head;
  head.lineage = std::strtoull(meta(database, "lineage").c_str(), nullptr, 16);
  head.voxel_size_m = std::atof(meta(database, "voxel_size_m").c_str());
  head.truncation_voxels = std::atof(meta(database, "truncation_voxels").c_str());
  head.min_publish_weight = std::atoi(meta(database, "min_publish_weight").c_str());
  if (head.lineage == 0) throw InputError(database.name() + ": has no lineage");
  return head;
}

FileHead prepare(Database& database, const TsdfConfig& map) {
  if (const auto head = read_head(database)) {
    refuse_other(database.name(), "voxel_size_m", head->voxel_size_m, map.voxel_size_m);
    refuse_other(database.name(), "truncation_voxels", head->truncation_voxels,
                 map.truncation_voxels);
    refuse_other(database.name(), "min_publish_weight", head->min_publish_weight,
                 map.min_publish_weight);
    return *head;
  }
  const FileHead head{random_number(), map.voxel_size_m, map.truncation_voxels,
                      map.min_publish_weight};
  Transaction transaction(database);
  database.execute(kTablesSql);
  put_meta(database, "lineage", hex(head.lineage));
  put_meta(database, "pieces_version", std::to_string(kPiecesVersion));
  put_meta(database, "voxel_size_m", exact(head.voxel_size_m));
  put_meta(database, "truncation_voxels", exact(head.truncation_voxels));
  put_meta(database, "min_publish_weight", std::to_string(head.min_publish_weight));
  database.execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                   "; PRAGMA user_version = " + std::to_string(kFileVersion));
  transaction.commit();
  return head;
}

std::int64_t start_run(Database& database, const ClassMap& classes, const MemoryRun& run,
                       std::uint64_t first_event) {
  Transaction transaction(database);
  const std::int64_t number = database.number("SELECT ifnull(max(run), 0) + 1 FROM runs");
  Statement put(database, "INSERT INTO runs VALUES(?1, ?2, ?3, ?4, ?5, 0)");
  put.bind(1, number)
      .bind_text(2, hex(run.epoch))
      .bind_text(3, run.program)
      .bind(4, run.started_ns)
      .bind(5, static_cast<std::int64_t>(first_event))
      .run();
  Statement name(database, "INSERT OR REPLACE INTO classes VALUES(?1, ?2)");
  for (const ClassInfo& info : classes.list) name.bind(1, info.id).bind_text(2, info.name).run();
  transaction.commit();
  return number;
}

void end_run(Database& database, std::int64_t run) {
  Statement(database, "UPDATE runs SET ended = 1 WHERE run = ?1").bind(1, run).run();
  database.execute("PRAGMA incremental_vacuum; PRAGMA wal_checkpoint(TRUNCATE)");
}

std::optional<StoredState> read_state(Database& database) {
  Statement statement(database, "SELECT sum, data FROM state WHERE id = 1");
  if (!statement.step()) return std::nullopt;
  const std::vector<std::uint8_t> data = statement.blob(1);
  if (static_cast<std::uint64_t>(statement.integer(0)) != row_sum(1, data.data(), data.size())) {
    throw InputError(database.name() + ": the state of the last step is damaged");
  }
  StoredState state;
  unarchive(data, database.name() + ": state", state);
  return state;
}

}  // namespace pocd::memory
