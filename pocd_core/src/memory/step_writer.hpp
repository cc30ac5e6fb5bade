// Writes steps, one transaction each.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "database.hpp"
#include "pocd/memory/memory_config.hpp"
#include "stored_state.hpp"

namespace pocd::memory {

/// Not thread-safe.
class StepWriter {
 public:
  /// `state` is what the file holds.
  StepWriter(Database& database, const MemoryConfig& config, StoredState state);

  /// All of the step or nothing of it. Throws DatabaseError.
  void write(const MemoryStep& step);
  /// As of the last step that was written.
  const StoredState& state() const { return state_; }
  /// Of all rows so far.
  std::uint64_t written_bytes() const { return written_bytes_; }

 private:
  void put(Table table, std::int64_t key, const void* data, std::size_t size);
  void erase(Table table, std::int64_t key);
  void put_tile(const MemoryStep& step, const TileStep& tile);
  void put_events(const MemoryStep& step);
  void drop_old_events(StampNs newest_ns);
  void put_state();

  struct Statements {
    Statements(Database& database, const char* table);
    Statement sum, put, erase;
  };

  Database& database_;
  const MemoryConfig config_;
  StoredState state_;    // as written
  StoredState pending_;  // of the transaction that is open
  std::uint64_t written_bytes_ = 0;
  std::array<std::unique_ptr<Statements>, kTables> tables_;
  Statement put_event_, oldest_event_, drop_event_, put_standing_, drop_standing_, put_state_;
};

}  // namespace pocd::memory
