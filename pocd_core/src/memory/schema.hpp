// The file's tables and its version.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "database.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "stored_state.hpp"

namespace pocd::memory {

constexpr int kFileVersion = 3;
constexpr std::int64_t kApplicationId = 0x504F4344;  // "POCD"
constexpr const char* kFileName = "memory.sqlite";

/// Whether there is a file, and of which lineage and map it is.
struct FileHead {
  std::uint64_t lineage = 0;
  double voxel_size_m = 0.0;
  double truncation_voxels = 0.0;
  int min_publish_weight = 0;
};

/// Reads the head. Nothing for a file without tables. Throws InputError for a file that is no
/// memory, or of another version than this program knows.
std::optional<FileHead> read_head(Database& database);
/// Makes the tables of a new file, in one transaction, or checks those there are. Throws InputError
/// when the map there is of another kind than `map`.
FileHead prepare(Database& database, const TsdfConfig& map);
/// Notes a run and the names of classes; its number.
std::int64_t start_run(Database& database, const ClassMap& classes, const MemoryRun& run,
                       std::uint64_t first_event);
/// The run has ended in order: the log of changes is taken into the file, which gives up the pages
/// that it does not use.
void end_run(Database& database, std::int64_t run);
/// Nothing when no step was written yet. Throws InputError when it is damaged.
std::optional<StoredState> read_state(Database& database);

}  // namespace pocd::memory
