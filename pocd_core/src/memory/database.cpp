#include "database.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cerrno>
#include <cstring>

namespace pocd::memory {
namespace {

constexpr int kWait_ms = 5000;  // for a reader of another process that is in the way

}  // namespace

bool DatabaseError::passing() const {
  switch (code_ & 0xFF) {
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_NOMEM:
      return true;
    default:
      return false;
  }
}

std::uint64_t row_sum(std::uint64_t key, const void* data, std::size_t size) {
  return XXH3_64bits_withSeed(data, size, key);
}

Statement::Statement(Database& database, const char* query) : database_(&database) {
  sqlite3_stmt* raw = nullptr;
  const int result =
      sqlite3_prepare_v3(database.handle(), query, -1, SQLITE_PREPARE_PERSISTENT, &raw, nullptr);
  statement_.reset(raw);
  if (result != SQLITE_OK) database.fail("cannot be read");
}

Statement& Statement::bind(int parameter, std::int64_t value) {
  if (parameter == 1) reset();
  sqlite3_bind_int64(statement_.get(), parameter, value);
  return *this;
}

Statement& Statement::bind_blob(int parameter, const void* data, std::size_t size) {
  if (parameter == 1) reset();
  // An empty blob is no null.
  sqlite3_bind_blob64(statement_.get(), parameter, size == 0 ? "" : data, size, SQLITE_STATIC);
  return *this;
}

Statement& Statement::bind_text(int parameter, const std::string& text) {
  if (parameter == 1) reset();
  sqlite3_bind_text(statement_.get(), parameter, text.data(), static_cast<int>(text.size()),
                    SQLITE_TRANSIENT);
  return *this;
}

bool Statement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  if (result == SQLITE_DONE) return false;
  sqlite3_reset(statement_.get());
  database_->fail("failed");
}

void Statement::run() {
  while (step()) {
  }
  reset();
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

bool Statement::has(int column) const {
  return sqlite3_column_type(statement_.get(), column) != SQLITE_NULL;
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string Statement::text(int column) const {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (data == nullptr) return "";
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::vector<std::uint8_t> Statement::blob(int column) const {
  const auto* data =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  if (data == nullptr) return {};
  return {data, data + size};
}

Database::Database(const std::filesystem::path& file, Access access) : name_(file.string()) {
  const int flags =
      access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* raw = nullptr;
  const int result = sqlite3_open_v2(file.c_str(), &raw, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(raw);
  if (result != SQLITE_OK) {
    const int why = raw ? sqlite3_system_errno(raw) : 0;
    throw DatabaseError(
        name_ + ": cannot be opened: " + (why != 0 ? std::strerror(why) : sqlite3_errstr(result)),
        result);
  }
  sqlite3_extended_result_codes(raw, 1);
  sqlite3_busy_timeout(raw, kWait_ms);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  // Of a new file only. Rows of a few kB leave less of a small page empty, and pages that are not
  // used any more can be given back.
  if (access == Access::kWrite)
    execute("PRAGMA page_size = 1024; PRAGMA auto_vacuum = INCREMENTAL");
  execute("PRAGMA cell_size_check = ON; PRAGMA temp_store = MEMORY;");
}

void Database::execute(const std::string& queries) {
  if (sqlite3_exec(handle(), queries.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail("failed");
  }
}

std::int64_t Database::number(const std::string& query) {
  Statement statement(*this, query.c_str());
  if (!statement.step()) fail("has no answer");
  return statement.integer(0);
}

void Database::fail(const std::string& what) const {
  sqlite3* db = database_.get();
  const int code = sqlite3_extended_errcode(db);
  std::string text = name_ + ": " + what + ": " + sqlite3_errmsg(db);
  const int why = sqlite3_system_errno(db);
  const int kind = code & 0xFF;
  if (why != 0 && (kind == SQLITE_IOERR || kind == SQLITE_CANTOPEN || kind == SQLITE_FULL)) {
    text += std::string(" (") + std::strerror(why) + ")";
  }
  throw DatabaseError(text, code);
}

Transaction::~Transaction() {
  if (!open_) return;
  // A full disk has ended the transaction already.
  sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

}  // namespace pocd::memory
