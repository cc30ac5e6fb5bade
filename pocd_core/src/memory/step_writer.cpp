#include "step_writer.hpp"

#include <algorithm>
#include <utility>

#include "../map/zstd_codec.hpp"
#include "pocd/common/check.hpp"
#include "voxel_page.hpp"

namespace pocd::memory {
namespace {

constexpr int kLevel = 1;
constexpr int kMostDropped = 1000;  // events in one step
constexpr double kDay_ns = 86400e9;

std::int64_t bits(std::uint64_t v) { return static_cast<std::int64_t>(v); }

}  // namespace

StepWriter::Statements::Statements(Database& database, const char* table)
    : sum(database, (std::string("SELECT sum FROM ") + table + " WHERE key = ?1").c_str()),
      put(database,
          (std::string("INSERT OR REPLACE INTO ") + table + " VALUES(?1, ?2, ?3)").c_str()),
      erase(database, (std::string("DELETE FROM ") + table + " WHERE key = ?1").c_str()) {}

StepWriter::StepWriter(Database& database, const MemoryConfig& config, StoredState state)
    : database_(database),
      config_(config),
      state_(std::move(state)),
      put_event_(database, "INSERT OR REPLACE INTO events VALUES(?1, ?2, ?3, ?4, ?5, ?6)"),
      oldest_event_(
          database,
          "SELECT seq, stamp_ns, object, run, sum, data FROM events ORDER BY seq LIMIT 1"),
      drop_event_(database, "DELETE FROM events WHERE seq = ?1"),
      put_standing_(database, "INSERT OR REPLACE INTO standing VALUES(?1, ?2, ?3, ?4, ?5)"),
      drop_standing_(database, "DELETE FROM standing WHERE object = ?1"),
      put_state_(database, "INSERT OR REPLACE INTO state VALUES(1, ?1, ?2)") {
  for (int t = 0; t < kTables; ++t) {
    tables_[t] = std::make_unique<Statements>(database, kTableNames[t]);
  }
}

void StepWriter::put(Table table, std::int64_t key, const void* data, std::size_t size) {
  Statements& s = *tables_[table];
  Total& total = pending_.totals[table];
  const std::uint64_t sum = row_sum(static_cast<std::uint64_t>(key), data, size);
  if (s.sum.bind(1, key).step()) {
    const auto before = static_cast<std::uint64_t>(s.sum.integer(0));
    s.sum.reset();
    if (before == sum) return;
    total.sum -= before;
    --total.rows;
  }
  s.sum.reset();
  s.put.bind(1, key).bind(2, bits(sum)).bind_blob(3, data, size).run();
  total.sum += sum;
  ++total.rows;
  written_bytes_ += size;
}

void StepWriter::erase(Table table, std::int64_t key) {
  Statements& s = *tables_[table];
  Total& total = pending_.totals[table];
  if (s.sum.bind(1, key).step()) {
    total.sum -= static_cast<std::uint64_t>(s.sum.integer(0));
    --total.rows;
    s.sum.reset();
    s.erase.bind(1, key).run();
  }
  s.sum.reset();
}

void StepWriter::put_tile(const MemoryStep& step, const TileStep& tile) {
  const std::int64_t row = row_of(tile.key);
  if (tile.payload.empty()) {
    erase(kTiles, row);
  } else {
    SaveArchive a;
    a(tile.version);
    const auto& payload = tile.payload.bytes();
    a.raw(payload.data(), payload.size());
    const std::vector<std::uint8_t> data = a.take();
    put(kTiles, row, data.data(), data.size());
  }
  if (tile.mask == 0) {
    erase(kVoxels, row);
    erase(kVoxelIndex, row);
    return;
  }
  const VoxelPage page = encode_voxels(tile.mask, &step.blocks[tile.first], tile.payload);
  put(kVoxels, row, page.bytes.data(), page.bytes.size());
  SaveArchive index;
  index(page.mask, page.owners);
  const std::vector<std::uint8_t> data = index.take();
  put(kVoxelIndex, row, data.data(), data.size());
}

void StepWriter::put_events(const MemoryStep& step) {
  for (const ObjectEvent& event : step.events) {
    const std::vector<std::uint8_t> data = archived(event);
    const std::uint64_t sum = row_sum(event.sequence, data.data(), data.size());
    put_event_.bind(1, bits(event.sequence))
        .bind(2, event.stamp_ns)
        .bind(3, to_index(event.object))
        .bind(4, pending_.run)
        .bind(5, bits(sum))
        .bind_blob(6, data.data(), data.size())
        .run();
    pending_.last_event = event.sequence;
    pending_.event_bytes += data.size();
    written_bytes_ += data.size();
  }
}

// What is dropped still tells where an object stands that nothing was heard of since.
void StepWriter::drop_old_events(StampNs newest_ns) {
  const auto limit_ns = static_cast<double>(newest_ns) - config_.keep_events_days * kDay_ns;
  const auto limit_bytes = static_cast<std::uint64_t>(config_.keep_events_mb) * 1'000'000;
  for (int i = 0; i < kMostDropped; ++i) {
    oldest_event_.reset();
    if (!oldest_event_.step()) break;
    const std::int64_t seq = oldest_event_.integer(0), object = oldest_event_.integer(2);
    const std::int64_t run = oldest_event_.integer(3), sum = oldest_event_.integer(4);
    const bool old = static_cast<double>(oldest_event_.integer(1)) < limit_ns;
    const std::vector<std::uint8_t> data = oldest_event_.blob(5);
    oldest_event_.reset();
    if (!old && pending_.event_bytes <= limit_bytes) break;
    ObjectEvent event;
    event.kind = EventKind::kRemoved;
    try {
      unarchive(data, "event", event);
    } catch (const InputError&) {  // damaged: its object is not known to stand anywhere
    }
    if (event.absorbed) drop_standing_.bind(1, to_index(*event.absorbed)).run();
    if (event.kind == EventKind::kRemoved || event.kind == EventKind::kOperator) {
      drop_standing_.bind(1, object).run();
    } else {
      put_standing_.bind(1, object)
          .bind(2, seq)
          .bind(3, run)
          .bind(4, sum)
          .bind_blob(5, data.data(), data.size())
          .run();
    }
    drop_event_.bind(1, seq).run();
    pending_.event_bytes -= std::min<std::uint64_t>(pending_.event_bytes, data.size());
  }
  oldest_event_.reset();
}

void StepWriter::put_state() {
  const std::vector<std::uint8_t> data = archived(pending_);
  put_state_.bind(1, bits(row_sum(1, data.data(), data.size())))
      .bind_blob(2, data.data(), data.size())
      .run();
}

void StepWriter::write(const MemoryStep& step) {
  pending_ = step.state;
  pending_.step = state_.step + 1;
  pending_.totals = state_.totals;
  pending_.last_event = state_.last_event;
  pending_.event_bytes = state_.event_bytes;
  Transaction transaction(database_);
  for (const Piece& piece : step.pieces) {
    const auto table = static_cast<Table>(piece.kind);
    const auto key = static_cast<std::int64_t>(piece.key);
    if (piece.bytes.empty()) {
      erase(table, key);
    } else {
      const std::vector<std::uint8_t> data = compress(piece.bytes, kLevel, piece.sections);
      put(table, key, data.data(), data.size());
    }
  }
  for (const TileStep& tile : step.tiles) put_tile(step, tile);
  put_events(step);
  drop_old_events(pending_.stamp_ns);
  put_state();
  transaction.commit();
  state_ = std::move(pending_);
}

}  // namespace pocd::memory
