// How much memory the voxel map may take, and what became of that.
#pragma once

#include <cstdint>
#include <string>

#include "pocd/common/describe.hpp"

namespace pocd {

/// Where voxels are.
enum class MapLimit {
  kNone,    ///< in memory
  kBudget,  ///< in memory up to a budget; beyond it, the least recently seen ones go to disk
};
inline EnumWords<MapLimit> words_of(MapLimit) {
  return {{MapLimit::kNone, "none"}, {MapLimit::kBudget, "budget"}};
}

struct MapMemoryConfig {
  MapLimit limit = MapLimit::kNone;
  int budget_mb = 1024;
  std::string folder = "/var/tmp";

  bool limited() const { return limit == MapLimit::kBudget; }
  std::uint64_t budget_bytes() const { return static_cast<std::uint64_t>(budget_mb) << 20; }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("limit", limit,
          "Voxels stay in memory, or the least recently seen ones go to disk and come back when "
          "they are seen again. The map is the same, bit by bit.");
    visit("budget_mb", budget_mb, Range{1, 1000000},
          "Memory that the voxels and their index may take when limit is budget [MiB].");
    visit(
        "folder", folder,
        "Folder for what is not in memory, in one file without a name that ends with the process.");
  }
};

/// Counts are those since the map was made, unless they say "now".
struct MapMemoryStatus {
  bool limited = false;
  std::uint64_t budget_bytes = 0;
  std::uint64_t memory_bytes = 0;        ///< now: voxels and their index
  std::uint64_t blocks_in_memory = 0;    ///< now
  std::uint64_t blocks_on_disk = 0;      ///< now
  std::uint64_t disk_bytes = 0;          ///< now: the file's used part
  std::uint64_t evictions = 0;           ///< regions written
  std::uint64_t returns = 0;             ///< regions read back
  std::uint64_t write_failures = 0;      ///< regions that stayed in memory because of the disk
  std::uint64_t blocks_lost = 0;         ///< could not be read back
  std::uint64_t frames_over_budget = 0;  ///< frames that needed more than the budget at once
};

/// Parts of the map that were handed out for work: what a frame costs must not grow with the map.
struct MapVisits {
  std::uint64_t regions = 0;
  std::uint64_t blocks = 0;
};

}  // namespace pocd
