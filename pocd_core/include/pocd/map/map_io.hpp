// The whole map in one file: every voxel with weight and owner, unlike the quantised tiles.
#pragma once

#include <filesystem>

#include "pocd/map/tsdf_map.hpp"

namespace pocd {

/// Writes beside the target and renames, so that a reader never meets half a file. Equal maps give
/// equal bytes. Throws InputError naming the file when it cannot be written.
void save_map(const TsdfMap& map, const std::filesystem::path& file);

/// The map as saved, under `config`, every block dirty. Throws InputError naming the file when it
/// is missing, of another version, damaged (each part has a checksum), cut short, or made with
/// another voxel size or truncation than `config` has.
TsdfMap load_map(const std::filesystem::path& file, const TsdfConfig& config);

}  // namespace pocd
