// Structs as they are in the file.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "../pipeline/archive_basics.hpp"
#include "pocd/common/archive.hpp"
#include "pocd/map/map_delta.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {

template <class Archive>
void archive(Archive& a, MapDigest& d) {
  a(d.low, d.high);
}

template <class Archive>
void archive(Archive& a, ObjectEvent& event) {
  auto& [sequence, kind, object, class_id, stamp_ns, frame_sequence, robot, box, previous_box,
         absorbed, arrival, evidence, last_there_ns, first_gone_ns, by] = event;
  const std::uint8_t layout = a.version(2, 1);
  a(sequence, kind, object, class_id, stamp_ns, frame_sequence, robot, box, previous_box, absorbed,
    evidence, last_there_ns, first_gone_ns, by);
  if (layout >= 2) a(arrival);
  if constexpr (Archive::kLoads) {
    if (arrival > Arrival::kArrived) a.fail("has an arrival of no known kind");
    if (kind < EventKind::kAdded || kind > EventKind::kOperator) a.fail("is of no known kind");
  }
}

template <class Archive>
void archive(Archive& a, PocdPipeline::Numbers& n) {
  a(n.object, n.event);
}

namespace memory {

/// Tables whose rows have a key, a checksum and bytes.
enum Table {
  kParts,
  kObjects,
  kSurfaces,
  kFreeSpaceTable,
  kRegionsTable,
  kTiles,
  kVoxelIndex,
  kVoxels,
  kTables
};
constexpr std::array<const char*, kTables> kTableNames = {
    "parts", "objects", "surfaces", "free_space", "regions", "tiles", "voxel_index", "voxels"};
static_assert(kPieceKinds == kTiles, "each kind of piece has a table of its number");

/// Of all rows of a table: a row that is missing or of another time is noticed.
struct Total {
  std::uint64_t rows = 0;
  std::uint64_t sum = 0;  ///< of the checksums, modulo 2^64
  bool operator==(const Total& o) const { return rows == o.rows && sum == o.sum; }
};

template <class Archive>
void archive(Archive& a, Total& t) {
  a(t.rows, t.sum);
}

/// What one step says of itself and of the file.
struct StoredState {
  std::uint64_t step = 0;
  std::int64_t run = 0;
  bool clean = false;  ///< the run has ended in order, with this step
  StampNs stamp_ns = 0;
  std::uint64_t map_version = 0;
  MapDigest digest;
  PocdPipeline::Numbers next;      ///< what comes next
  PocdPipeline::Numbers reserved;  ///< below these, numbers may have been used and not stored
  std::array<Total, kTables> totals;
  std::uint64_t last_event = 0;   ///< 0: none yet
  std::uint64_t event_bytes = 0;  ///< of the log
  std::vector<std::uint8_t> progress;
};

template <class Archive>
void archive(Archive& a, StoredState& s) {
  a.version(1);
  a(s.step, s.run, s.clean, s.stamp_ns, s.map_version, s.digest, s.next, s.reserved, s.totals,
    s.last_event, s.event_bytes, s.progress);
}

/// Voxels and published form of one tile at one step.
struct TileStep {
  TileKey key;
  std::uint8_t mask = 0;  ///< blocks there are
  std::size_t first = 0;  ///< of them, in MemoryStep::blocks
  std::uint64_t version = 0;
  TilePayload payload;  ///< empty: nothing is published of it
};

/// Everything that one transaction writes.
struct MemoryStep {
  StoredState state;  ///< without what the file knows itself: step, totals, event_bytes
  std::vector<Piece> pieces;
  std::vector<TileStep> tiles;
  std::vector<VoxelBlock> blocks;
  std::vector<ObjectEvent> events;
};

}  // namespace memory
}  // namespace pocd
