#include "tsdf_kernel.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/common/kernel.hpp"

namespace pocd {
namespace {

constexpr int kVoxels = VoxelBlock::kVoxels;
constexpr float kBehind = -1e30f;   // signed distance of voxels that no valid pixel sees
constexpr float kMinDepth = 0.01f;  // [m]; nearer voxels are left alone

// What average() says about a voxel.
constexpr std::int32_t kContradicted = 1, kApplied = 2, kFree = 4, kSurface = 8, kWasEmpty = 16,
                       kChanged = 32;

// GCC 12 vectorises a loop with a gather only where the arrays are restrict parameters, and mixed
// conditions only as nested selections or 0/1 integers: hence the shape of these functions.

// Where each voxel projects to (nearest pixel) and minus its depth, or kBehind out of view.
POCD_KERNEL void find_pixels(const KernelFrame& f, float bx, float by, float bz,
                             std::int32_t* __restrict pixel, std::int32_t* __restrict owner_pixel,
                             float* __restrict minus_z) {
  const float width = f.width, height = f.height, fx = f.fx, fy = f.fy;
  const float cx = f.cx + 0.5f, cy = f.cy + 0.5f;
  const float owner_scale = f.owner_scale, max_u = f.owner_max_u, max_v = f.owner_max_v;
  const std::int32_t stride = f.depth_stride, owner_stride = f.owner_stride;
  for (int i = 0; i < kVoxels; ++i) {
    const float z = bz + f.offset_z[i];
    const float inverse = 1.0f / z;
    const float u = (bx + f.offset_x[i]) * inverse * fx + cx;
    const float v = (by + f.offset_y[i]) * inverse * fy + cy;
    const std::int32_t inside = (z > kMinDepth ? 1 : 0) & (u >= 0.0f ? 1 : 0) &
                                (u < width ? 1 : 0) & (v >= 0.0f ? 1 : 0) & (v < height ? 1 : 0);
    const auto pu = static_cast<std::int32_t>(inside ? u : 0.0f);
    const auto pv = static_cast<std::int32_t>(inside ? v : 0.0f);
    const float ou = (static_cast<float>(pu) + 0.5f) * owner_scale;
    const float ov = (static_cast<float>(pv) + 0.5f) * owner_scale;
    const auto ou_px = static_cast<std::int32_t>(ou < max_u ? ou : max_u);
    const auto ov_px = static_cast<std::int32_t>(ov < max_v ? ov : max_v);
    pixel[i] = pv * stride + pu;
    owner_pixel[i] = ov_px * owner_stride + ou_px;
    minus_z[i] = inside ? -z : kBehind;
  }
}

// Projective signed distance of each voxel, kBehind where no usable pixel sees it. A pixel beyond
// max_depth is usable for free space up to clear_depth. Returns whether the frame reaches any: in
// front of the surface or within the band behind it.
POCD_KERNEL bool look_up(float max_depth, float clear_depth, float truncation,
                         const float* __restrict depth, const std::uint32_t* __restrict owners,
                         const std::int32_t* __restrict pixel,
                         const std::int32_t* __restrict owner_pixel,
                         const float* __restrict minus_z, float* __restrict distance,
                         std::uint32_t* __restrict owner) {
  std::int32_t reached = 0;
  for (int i = 0; i < kVoxels; ++i) {
    const float d = depth[pixel[i]];
    const std::uint32_t o = owners[owner_pixel[i]];
    const float s = d + minus_z[i];
    const float near = minus_z[i] >= -clear_depth ? s : kBehind;
    const float clear = s >= truncation ? near : kBehind;
    const float in_range = d <= max_depth ? s : clear;
    const float seen = d > 0.0f ? in_range : kBehind;
    const float s_usable = o != IntegrationInput::kSkip ? seen : kBehind;
    distance[i] = s_usable;
    owner[i] = o;
    reached |= s_usable >= -truncation ? 1 : 0;
  }
  return reached != 0;
}

// Whether some observed voxel is no free space.
POCD_KERNEL bool holds_surface(const std::int16_t* __restrict tsdf,
                               const std::uint16_t* __restrict weight) {
  std::int32_t any = 0;
  for (int i = 0; i < kVoxels; ++i) {
    any |= (weight[i] > 0 ? 1 : 0) & (tsdf[i] < kFreeTsdf ? 1 : 0);
  }
  return any != 0;
}

// Running weighted average of the voxels in front of the surface and in the band behind it. `state`
// says what became of each voxel. Returns whether some voxel was left to carve() because its stored
// surface is contradicted.
POCD_KERNEL bool average(float truncation, float voxel, float max_weight, float free_weight,
                         const float* __restrict distance, std::int16_t* __restrict tsdf,
                         std::uint16_t* __restrict weight, std::int32_t* __restrict state) {
  const float scale = kTsdfScale / truncation;
  const float conflict = kConflictVoxels * voxel * scale, behind = -kBehindVoxels * voxel;
  std::int32_t all = 0;
  for (int i = 0; i < kVoxels; ++i) {
    const float s = distance[i];
    const std::int32_t t_old = tsdf[i];
    const std::int32_t w_old = weight[i];
    const std::int32_t contradicts =
        (s >= truncation ? kContradicted : 0) & (w_old > 0 ? -1 : 0) & (t_old < kFreeTsdf ? -1 : 0);
    const std::int32_t stays_free =
        (s < behind ? 1 : 0) & (t_old >= kFreeTsdf ? 1 : 0) & (w_old >= kKnownFreeWeight ? 1 : 0);
    const std::int32_t apply = (s >= -truncation ? -1 : 0) & ((contradicts | stays_free) ? 0 : -1);
    const float t = static_cast<float>(t_old);
    const float target = (s < truncation ? s : truncation) * scale;
    // What was inside lies well in front of a surface now, or the reverse.
    const float change = target - t > 0.0f ? target - t : t - target;
    const std::int32_t opposed = (target < 0.0f ? 1 : 0) ^ (t < 0.0f ? 1 : 0);
    const std::int32_t halve = opposed & (change >= conflict ? 1 : 0) & (s >= behind ? 1 : 0);
    const float w = static_cast<float>(w_old) * (halve ? 0.5f : 1.0f);
    const float mean = (t * w + target) / (w + 1.0f);
    // Round to nearest: truncation of a positive number is its floor.
    const std::int32_t t_new = static_cast<std::int32_t>((apply ? mean : t) + 32768.5f) - 32768;
    const std::int32_t is_free = t_new >= kFreeTsdf ? -1 : 0;
    const float cap = is_free ? free_weight : max_weight;
    const float grown = w + 1.0f < cap ? w + 1.0f : cap;
    const std::int32_t w_new = apply ? static_cast<std::int32_t>(grown) : w_old;
    tsdf[i] = static_cast<std::int16_t>(t_new);
    weight[i] = static_cast<std::uint16_t>(w_new);
    const std::int32_t changed = (t_new ^ t_old) | (w_new ^ w_old);

    const std::int32_t surface = (w_new > 0 ? kSurface : 0) & ~is_free & (contradicts ? 0 : -1);
    const std::int32_t now = contradicts | (apply & kApplied) | (is_free & kFree) | surface |
                             (w_old == 0 ? kWasEmpty : 0) | (t_old >= kFreeTsdf ? kWasEmpty : 0) |
                             (changed ? kChanged : 0);
    state[i] = now;
    all |= now;
  }
  state[kVoxels] = all;
  return (all & kContradicted) != 0;
}

// Owners of the voxels that average() changed. any and all get the union and the intersection of
// the bits of the owners written, which are equal when it was one owner only.
POCD_KERNEL bool own(float band, const float* __restrict distance,
                     const std::int32_t* __restrict state,
                     const std::uint32_t* __restrict pixel_owner, std::uint32_t* __restrict owner,
                     std::uint32_t& any, std::uint32_t& all) {
  std::uint32_t written_any = 0, written_all = 0xFFFFFFFFu, changed = 0;
  for (int i = 0; i < kVoxels; ++i) {
    const float s = distance[i];
    const std::int32_t now = state[i];
    const std::uint32_t old = owner[i];
    // The inside of a thing that came to where nothing was has its owner: past the band it ends in
    // free space, with a back that nobody saw.
    const std::int32_t fresh = ((now & kWasEmpty) ? -1 : 0) & (s < 0.0f ? -1 : 0);
    const std::int32_t near = ((s >= -band ? -1 : 0) & (s <= band ? -1 : 0)) | fresh;
    const std::int32_t applied = (now & kApplied) ? -1 : 0;
    const std::int32_t is_free = (now & kFree) ? -1 : 0;
    const auto take = static_cast<std::uint32_t>(near & applied & ~is_free);
    const auto release = static_cast<std::uint32_t>(applied & is_free);
    const std::uint32_t taken = pixel_owner[i] & take;
    const std::uint32_t now_owner = taken | (old & ~take & ~release);
    owner[i] = now_owner;
    const std::uint32_t new_here = (now_owner != old ? 0xFFFFFFFFu : 0u) & take;
    written_any |= taken & new_here;
    written_all &= taken | ~new_here;
    changed |= now_owner ^ old;
  }
  any = written_any;
  all = written_all;
  return changed != 0;
}

// Asks for the memory that follows before it is needed.
void fetch(const void* memory, std::size_t bytes) {
#if defined(__GNUC__)
  for (std::size_t at = 0; at < bytes; at += 64) {
    __builtin_prefetch(static_cast<const char*>(memory) + at, 1);
  }
#endif
}

// Whether a pixel next to the voxel's saw something that is not clearly behind the voxel.
bool beside_an_edge(const KernelFrame& f, float x, float y, float z) {
  const int u = static_cast<int>(x / z * f.fx + f.cx + 0.5f);
  const int v = static_cast<int>(y / z * f.fy + f.cy + 0.5f);
  const int width = static_cast<int>(f.width), height = static_cast<int>(f.height);
  const int first_u = std::max(0, u - kEdgeGuard_px);
  const int last_u = std::min(width - 1, u + kEdgeGuard_px);
  // A row without branches: what the pixels hold is not to be guessed.
  const auto near = [&](const float* row, int count) {
    bool any = false;
    for (int a = 0; a < count; ++a) any |= (row[a] > 0.0f) & (row[a] - z < f.truncation);
    return any;
  };
  constexpr int kWhole = 2 * kEdgeGuard_px + 1;
  const int count = last_u - first_u + 1;
  for (int b = std::max(0, v - kEdgeGuard_px); b <= std::min(height - 1, v + kEdgeGuard_px); ++b) {
    const float* row = f.depth + b * f.depth_stride + first_u;
    if (count == kWhole ? near(row, kWhole) : near(row, count)) return true;
  }
  return false;
}

// Voxels that hold a surface where the ray passes well in front of the measured depth. Each such
// observation halves the weight before it is averaged: one wrong frame moves a settled voxel by one
// part in max_weight / 2, but log2(max_weight) + 1 frames in a row empty it.
void carve(const KernelFrame& f, float bx, float by, float bz, const std::int32_t* state,
           VoxelBlock& block, BlockOutcome& outcome) {
  const auto carve_voxel = [&](int i) {
    if (beside_an_edge(f, bx + f.offset_x[i], by + f.offset_y[i], bz + f.offset_z[i])) {
      outcome.has_surface = true;
      return;
    }
    const int w = block.weight[i] / 2;
    const int t = (block.tsdf[i] * w + static_cast<int>(kTsdfScale)) / (w + 1);
    block.tsdf[i] = static_cast<std::int16_t>(t);
    block.weight[i] = static_cast<std::uint16_t>(std::max(w, 1));
    if (t >= kFreeTsdf) {
      // As well known as free space gets: with less it would leave a hole in the surface next to
      // it.
      block.weight[i] =
          static_cast<std::uint16_t>(std::min(f.max_weight, static_cast<float>(kFreeWeight)));
      block.owner[i] = 0;
    } else {
      outcome.has_surface = true;
    }
    outcome.changed = true;
  };
  for (int row = 0; row < kVoxels; row += VoxelBlock::kSide) {
    std::int32_t any = 0;  // most rows have none
    for (int k = 0; k < VoxelBlock::kSide; ++k) any |= state[row + k];
    if (!(any & kContradicted)) continue;
    for (int k = 0; k < VoxelBlock::kSide; ++k) {
      if (state[row + k] & kContradicted) carve_voxel(row + k);
    }
  }
}

}  // namespace

BlockOutcome integrate_block(const KernelFrame& frame, float x, float y, float z,
                             VoxelBlock& block) {
  alignas(64) std::int32_t pixel[kVoxels], owner_pixel[kVoxels], state[kVoxels + 1];
  alignas(64) float minus_z[kVoxels], distance[kVoxels];
  alignas(64) std::uint32_t owner[kVoxels];
  BlockOutcome outcome;
  fetch(block.tsdf.data(), sizeof block.tsdf);
  fetch(block.weight.data(), sizeof block.weight);
  find_pixels(frame, x, y, z, pixel, owner_pixel, minus_z);
  // A third of the blocks near the view lie behind what is seen.
  if (!look_up(frame.max_depth, frame.clear_depth, frame.truncation, frame.depth, frame.owners,
               pixel, owner_pixel, minus_z, distance, owner)) {
    outcome.has_surface = holds_surface(block.tsdf.data(), block.weight.data());
    return outcome;
  }
  fetch(block.owner.data(), sizeof block.owner);
  const float free_weight = std::min(frame.max_weight, static_cast<float>(kFreeWeight));
  const bool contradicted = average(frame.truncation, frame.voxel, frame.max_weight, free_weight,
                                    distance, block.tsdf.data(), block.weight.data(), state);
  outcome.changed = (state[kVoxels] & kChanged) != 0;
  outcome.has_surface = (state[kVoxels] & kSurface) != 0;
  outcome.changed |= own(frame.owner_band, distance, state, owner, block.owner.data(),
                         outcome.owner_any, outcome.owner_all);
  if (contradicted) carve(frame, x, y, z, state, block, outcome);
  return outcome;
}

POCD_KERNEL void sample_row(const float* __restrict depth_row,
                            const std::uint32_t* __restrict owner_row,
                            const std::int32_t* __restrict columns,
                            const std::int32_t* __restrict owner_columns, float max_depth,
                            int count, float* __restrict out) {
  for (int i = 0; i < count; ++i) {
    const float d = depth_row[columns[i]];
    const float in_range = d <= max_depth ? d : 0.0f;
    const float seen = d > 0.0f ? in_range : 0.0f;
    out[i] = owner_row[owner_columns[i]] != IntegrationInput::kSkip ? seen : 0.0f;
  }
}

POCD_KERNEL void band_cells(const BandRow& row, const float* depth, int count, float first_column,
                            float step, std::int32_t* cells) {
  const float ox = row.origin[0], oy = row.origin[1], oz = row.origin[2];
  const float rx = row.row[0], ry = row.row[1], rz = row.row[2];
  const float kx = row.column[0], ky = row.column[1], kz = row.column[2];
  const int size_x = row.size_x, size_xy = row.size_xy;
  const int points = static_cast<int>(row.samples) + 1;
  for (int p = 0; p < points; ++p) {
    const float offset = row.truncation * (2.0f * static_cast<float>(p) / row.samples - 1.0f);
    std::int32_t* __restrict out = cells + static_cast<std::ptrdiff_t>(p) * count;
    const float* __restrict in = depth;
    for (int j = 0; j < count; ++j) {
      const float u = first_column + static_cast<float>(j) * step;
      const float d = in[j];
      const float z = d + offset > 0.0f ? d + offset : 0.0f;
      const int gx = static_cast<int>(ox + z * (rx + u * kx));
      const int gy = static_cast<int>(oy + z * (ry + u * ky));
      const int gz = static_cast<int>(oz + z * (rz + u * kz));
      out[j] = d > 0.0f ? gx + size_x * gy + size_xy * gz : 0;
    }
  }
}

}  // namespace pocd
