#include "tsdf_kernel.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/common/kernel.hpp"

namespace pocd {
namespace {

constexpr int kVoxels = VoxelBlock::kVoxels;
constexpr float kBehind = -1e30f;  // signed distance of voxels that no valid pixel sees

struct Scratch {
  alignas(64) float distance[kVoxels];       // projective signed distance [m]
  alignas(64) std::uint32_t owner[kVoxels];  // of the pixel
};

// Looks up the pixel of every voxel (nearest neighbour).
POCD_KERNEL void project(const KernelFrame& f, float bx, float by, float bz, Scratch& out) {
  const float* __restrict ox = f.offset_x;
  const float* __restrict oy = f.offset_y;
  const float* __restrict oz = f.offset_z;
  const float* __restrict depth = f.depth;
  const std::uint32_t* __restrict owners = f.owners;
  const float width = f.width, height = f.height, fx = f.fx, fy = f.fy;
  const float cx = f.cx + 0.5f, cy = f.cy + 0.5f, max_depth = f.max_depth;
  const float owner_scale = f.owner_scale, max_u = f.owner_max_u, max_v = f.owner_max_v;
  const int stride = f.depth_stride, owner_stride = f.owner_stride;
  float* __restrict distance = out.distance;
  std::uint32_t* __restrict owner = out.owner;
  for (int i = 0; i < kVoxels; ++i) {
    const float z = bz + oz[i];
    const float inverse = 1.0f / z;
    const float u = (bx + ox[i]) * inverse * fx + cx;
    const float v = (by + oy[i]) * inverse * fy + cy;
    const bool inside = (z > 0.01f) & (u >= 0.0f) & (u < width) & (v >= 0.0f) & (v < height);
    const int pu = static_cast<int>(inside ? u : 0.0f);
    const int pv = static_cast<int>(inside ? v : 0.0f);
    const float d = depth[pv * stride + pu];
    const float ou = (static_cast<float>(pu) + 0.5f) * owner_scale;
    const float ov = (static_cast<float>(pv) + 0.5f) * owner_scale;
    const int ou_px = static_cast<int>(ou < max_u ? ou : max_u);
    const int ov_px = static_cast<int>(ov < max_v ? ov : max_v);
    const std::uint32_t o = owners[ov_px * owner_stride + ou_px];
    const bool valid = inside & (d > 0.0f) & (d <= max_depth) & (o != IntegrationInput::kSkip);
    distance[i] = valid ? d - z : kBehind;
    owner[i] = o;
  }
}

// Running weighted average of the voxels in front of the surface and in the band behind it. Returns
// whether some voxel was left to carve_block because its stored surface is contradicted.
POCD_KERNEL bool fuse(const KernelFrame& f, const Scratch& in, VoxelBlock& block,
                      BlockOutcome& outcome) {
  const float truncation = f.truncation, band = f.owner_band;
  const float scale = kTsdfScale / truncation;
  const float max_weight = f.max_weight;
  const float free_weight = std::min(max_weight, static_cast<float>(kFreeWeight));
  const float* __restrict distance = in.distance;
  const std::uint32_t* __restrict pixel_owner = in.owner;
  std::int16_t* __restrict tsdf = block.tsdf.data();
  std::uint16_t* __restrict weight = block.weight.data();
  std::uint32_t* __restrict owner = block.owner.data();
  std::int32_t changed = 0, contradicted = 0, surface = 0;
  std::uint32_t low = 0xFFFFFFFFu, high = 0;
  for (int i = 0; i < kVoxels; ++i) {
    const float s = distance[i];
    const std::int32_t t_old = tsdf[i];
    const std::int32_t w_old = weight[i];
    const std::uint32_t o_old = owner[i];
    const bool contradicts = (s >= truncation) & (w_old > 0) & (t_old < kFreeTsdf);
    const bool apply = (s >= -truncation) & !contradicts;
    const float w = static_cast<float>(w_old);
    const float target = (s < truncation ? s : truncation) * scale;
    const float mean = (static_cast<float>(t_old) * w + target) / (w + 1.0f);
    // Round to nearest: truncation of a positive number is its floor.
    const float rounded = (apply ? mean : static_cast<float>(t_old)) + 32768.5f;
    const std::int32_t t_new = static_cast<std::int32_t>(rounded) - 32768;
    const bool is_free = t_new >= kFreeTsdf;
    const float cap = is_free ? free_weight : max_weight;
    const float grown = w + 1.0f < cap ? w + 1.0f : cap;
    const std::int32_t w_new = static_cast<std::int32_t>(apply ? grown : w);
    const bool near = ((s >= -band) & (s <= band)) | ((w_old == 0) & (s < 0.0f));
    const bool take = apply & near & !is_free;
    const std::uint32_t o_kept = (apply & is_free) ? 0u : o_old;
    const std::uint32_t o_new = take ? pixel_owner[i] : o_kept;
    tsdf[i] = static_cast<std::int16_t>(t_new);
    weight[i] = static_cast<std::uint16_t>(w_new);
    owner[i] = o_new;
    changed |= (t_new ^ t_old) | (w_new ^ w_old) | static_cast<std::int32_t>(o_new ^ o_old);
    contradicted |= static_cast<std::int32_t>(contradicts);
    surface |= static_cast<std::int32_t>((w_new > 0) & !is_free);
    const std::uint32_t for_low = take ? o_new : 0xFFFFFFFFu;
    const std::uint32_t for_high = take ? o_new : 0u;
    low = for_low < low ? for_low : low;
    high = for_high > high ? for_high : high;
  }
  outcome.changed = changed != 0;
  outcome.has_surface = surface != 0;
  outcome.owner_low = low;
  outcome.owner_high = high;
  return contradicted != 0;
}

// Whether a pixel next to the voxel's saw something that is not clearly behind the voxel.
bool beside_an_edge(const KernelFrame& f, float x, float y, float z) {
  const int u = static_cast<int>(x / z * f.fx + f.cx + 0.5f);
  const int v = static_cast<int>(y / z * f.fy + f.cy + 0.5f);
  const int width = static_cast<int>(f.width), height = static_cast<int>(f.height);
  for (int b = std::max(0, v - kEdgeGuard_px); b <= std::min(height - 1, v + kEdgeGuard_px); ++b) {
    for (int a = std::max(0, u - kEdgeGuard_px); a <= std::min(width - 1, u + kEdgeGuard_px); ++a) {
      const float d = f.depth[b * f.depth_stride + a];
      if (d > 0.0f && d - z < f.truncation) return true;
    }
  }
  return false;
}

// Voxels that hold a surface where the ray passes well in front of the measured depth. Each such
// observation halves the weight before it is averaged: one wrong frame moves a settled voxel by one
// part in max_weight / 2, but log2(max_weight) + 1 frames in a row empty it.
void carve(const KernelFrame& f, float bx, float by, float bz, const Scratch& in, VoxelBlock& block,
           BlockOutcome& outcome) {
  bool surface = false;
  for (int i = 0; i < kVoxels; ++i) {
    const int w_old = block.weight[i];
    if (w_old == 0 || block.tsdf[i] >= kFreeTsdf) continue;
    if (in.distance[i] < f.truncation ||
        beside_an_edge(f, bx + f.offset_x[i], by + f.offset_y[i], bz + f.offset_z[i])) {
      surface = true;
      continue;
    }
    const int w = w_old / 2;
    const int t = (block.tsdf[i] * w + static_cast<int>(kTsdfScale)) / (w + 1);
    block.tsdf[i] = static_cast<std::int16_t>(t);
    block.weight[i] = static_cast<std::uint16_t>(std::max(w, 1));
    if (t >= kFreeTsdf) {
      block.owner[i] = 0;
    } else {
      surface = true;
    }
    outcome.changed = true;
  }
  outcome.has_surface = surface;
}

}  // namespace

BlockOutcome integrate_block(const KernelFrame& frame, float x, float y, float z,
                             VoxelBlock& block) {
  Scratch scratch;
  BlockOutcome outcome;
  project(frame, x, y, z, scratch);
  if (fuse(frame, scratch, block, outcome)) carve(frame, x, y, z, scratch, block, outcome);
  return outcome;
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
