// SQLite with errors that name the file, and statements that end by themselves.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace pocd::memory {

/// What SQLite says that it could not do, with its extended result code.
class DatabaseError : public std::runtime_error {
 public:
  DatabaseError(const std::string& what, int code) : std::runtime_error(what), code_(code) {}
  int code() const { return code_; }
  /// The disk did not take or give something; it may do so later.
  bool passing() const;

 private:
  int code_;
};

/// Checksum of a row: it tells rows with equal bytes and different keys apart.
std::uint64_t row_sum(std::uint64_t key, const void* data, std::size_t size);

class Database;

/// A statement that is prepared once. bind() and step() as in SQLite; reset by run() and by the
/// next bind of parameter 1. Not thread-safe.
class Statement {
 public:
  Statement(Database& database, const char* query);

  Statement& bind(int parameter, std::int64_t value);
  Statement& bind_blob(int parameter, const void* data, std::size_t size);
  Statement& bind_text(int parameter, const std::string& text);
  /// True: there is a row. Throws DatabaseError.
  bool step();
  void run();
  void reset();

  bool has(int column) const;  ///< false: null
  std::int64_t integer(int column) const;
  std::string text(int column) const;
  std::vector<std::uint8_t> blob(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  Database* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// One connection. Not thread-safe.
class Database {
 public:
  enum class Access { kRead, kWrite };
  /// Throws DatabaseError. With kWrite a missing file is made.
  Database(const std::filesystem::path& file, Access access);

  void execute(const std::string& queries);
  /// The only value of the only row.
  std::int64_t number(const std::string& query);
  [[noreturn]] void fail(const std::string& what) const;
  sqlite3* handle() { return database_.get(); }
  const std::string& name() const { return name_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
  };
  std::string name_;
  std::unique_ptr<sqlite3, Close> database_;
};

/// Rolls back unless it was committed.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) {
    database.execute("BEGIN IMMEDIATE");
  }
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace pocd::memory
