// Looks into a memory, also while a node writes to it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pocd/map/map_delta.hpp"
#include "pocd/objects/frame_result.hpp"

namespace pocd {

/// An event of the log.
struct LoggedEvent {
  ObjectEvent event;
  std::int64_t run = 0;  ///< that has seen it, see MemoryInfo::runs
};

struct LoggedRun {
  std::int64_t run = 0;
  std::uint64_t epoch = 0;  ///< 0: it was not on a bus
  std::string program;
  StampNs started_ns = 0;         ///< wall clock
  std::uint64_t first_event = 0;  ///< the first one that may be of this run
  bool ended = false;             ///< in order
};

struct MemoryInfo {
  std::uint64_t lineage = 0;
  int file_version = 0;
  double voxel_size_m = 0.0, truncation_voxels = 0.0;
  int min_publish_weight = 0;
  std::uint64_t steps = 0;
  bool ended_clean = false;
  StampNs stamp_ns = 0;  ///< of the last frame
  std::uint64_t map_version = 0;
  MapDigest digest;
  std::uint64_t objects = 0;  ///< tentative ones too
  std::uint64_t free_blocks = 0, tiles = 0, voxel_tiles = 0;
  std::uint64_t first_event = 0, last_event = 0, events = 0;  ///< of the log; 0: none
  std::uint64_t event_bytes = 0, file_bytes = 0;
  std::vector<LoggedRun> runs;
};

/// Reads only; sees the last step that was written at the time of a call. Not thread-safe.
class MemoryReader {
 public:
  /// Throws InputError when there is no memory in the folder, or one of another version.
  explicit MemoryReader(const std::filesystem::path& folder);
  ~MemoryReader();

  /// All of these throw InputError when the file cannot be read.
  MemoryInfo info();
  std::vector<LoggedRun> runs();
  /// First and last number of the log; 0, 0 for one without events.
  std::pair<std::uint64_t, std::uint64_t> range();
  std::uint64_t lineage() const;
  /// At most `most` events with a number above `after`, by number. Damaged ones are left out and
  /// counted.
  std::vector<LoggedEvent> events(std::uint64_t after, std::size_t most);
  /// The last event of each object that stood where the log begins, by object.
  std::vector<LoggedEvent> standing();
  std::uint64_t damaged_events() const;
  std::map<ClassId, std::string> class_names();
  /// Regions of the map (block key >> BlockKey::kRegionShift), and the stamp of the last frame that
  /// measured a surface in each.
  std::vector<std::pair<BlockKey, StampNs>> last_looks();

  /// The tiles of the map as it was published last. Rows that cannot be read are left out, with one
  /// line each in `damage`.
  std::vector<MapTile> tiles(std::vector<std::string>& damage);

  /// Reads everything: one line for each thing that is wrong.
  std::vector<std::string> verify();
  /// Writes the voxels as save_map() does, of the last step. Throws InputError.
  void export_map(const std::filesystem::path& file);
  /// Writes the last step as a folder of its own, which must not hold a memory. Throws InputError.
  void backup(const std::filesystem::path& folder);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Gives the room of what was dropped back to the disk; nobody may use the folder meanwhile.
/// Throws InputError.
void compact_memory(const std::filesystem::path& folder);

}  // namespace pocd
