// The inner loops of the integration. All arithmetic is single precision without contraction, so
// that every version of a kernel gives the same bits.
#pragma once

#include <cstdint>

#include "pocd/map/tsdf_map.hpp"
#include "pocd/map/voxel_block.hpp"

namespace pocd {

/// tsdf is stored as fraction of the truncation distance times this.
constexpr float kTsdfScale = 32767.0f;
/// At and above this stored value a voxel is free space: it bounds no cell that carries the
/// surface.
constexpr int kFreeTsdf = 29490;  // 0.9 of the truncation distance
/// Free space forgets quickly, so that a thing put there is mapped within as many frames.
constexpr int kFreeWeight = 8;
/// A voxel this near the measured surface takes the pixel's owner [voxels]: a cell that the surface
/// crosses has all corners within sqrt(3) voxels of it.
constexpr float kOwnerBandVoxels = 1.75f;
/// A voxel that changes sides by at least so much loses half of its weight before it is averaged: a
/// surface that shifted, and the band that a silhouette left behind it, follow within a few frames.
/// Beyond so far behind a surface nothing is known: it may be thin [voxels].
constexpr float kConflictVoxels = 2.0f;
constexpr float kBehindVoxels = 1.25f;
/// So many looks make free space known: what lies farther behind a surface stays free then.
constexpr int kKnownFreeWeight = 3;
/// Free space is not believed where a pixel this near saw something closer: poses are not exact,
/// and thin things would lose voxels at their outline [pixels].
constexpr int kEdgeGuard_px = 2;

/// One frame, as the kernels want it.
struct KernelFrame {
  const float* depth = nullptr;  // [m]; 0 or NaN = no return
  int depth_stride = 0;          // elements per row
  float width = 0, height = 0;
  float fx = 0, fy = 0, cx = 0, cy = 0;
  const std::uint32_t* owners = nullptr;
  int owner_stride = 0;  // elements per row; 0 with a single entry for "no owners given"
  float owner_max_u = 0, owner_max_v = 0;
  float owner_scale = 0;  // 1 / pixels per owner entry
  float max_depth = 0, clear_depth = 0, truncation = 0, owner_band = 0, voxel = 0;
  float max_weight = 0;
  // Voxel centres of a block relative to its first corner, in the camera frame [m].
  alignas(64) float offset_x[VoxelBlock::kVoxels];
  alignas(64) float offset_y[VoxelBlock::kVoxels];
  alignas(64) float offset_z[VoxelBlock::kVoxels];
};

/// What the integration did to one block.
struct BlockOutcome {
  bool changed = false;
  bool has_surface = false;  // some observed voxel is no free space
  /// Bitwise union and intersection of the owners that are new to a voxel: equal when it is one
  /// only; union 0 when it is none but background.
  std::uint32_t owner_any = 0, owner_all = 0xFFFFFFFFu;
  /// The store has not noted all of them for the block.
  bool notes_owners = false;
};

/// Fuses the frame into one block whose first corner lies at (x, y, z) in the camera frame [m].
BlockOutcome integrate_block(const KernelFrame& frame, float x, float y, float z,
                             VoxelBlock& block);

/// Grid cells that the truncation band of some pixels of one image row passes through.
struct BandRow {
  float origin[3];   // of the camera, in grid cells
  float row[3];      // ray of column 0 of this row per metre of depth, in grid cells
  float column[3];   // change of the ray per column
  float truncation;  // [m]
  float samples;     // points along the band minus one
  int size_x, size_xy;
};
constexpr int kBandBatch = 256;

/// Depth at `count` columns of an image row, 0 where it is not usable or its owner is kSkip.
void sample_row(const float* __restrict depth_row, const std::uint32_t* __restrict owner_row,
                const std::int32_t* __restrict columns,
                const std::int32_t* __restrict owner_columns, float max_depth, int count,
                float* __restrict out);

/// depth: `count` <= kBandBatch samples, 0 where nothing is to be done; first column and step say
/// which columns they are. cells gets (samples + 1) * count grid indices, 0 for unused samples.
void band_cells(const BandRow& row, const float* depth, int count, float first_column, float step,
                std::int32_t* cells);

}  // namespace pocd
