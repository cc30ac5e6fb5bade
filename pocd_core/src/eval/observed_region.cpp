#include "pocd/eval/observed_region.hpp"

#include <algorithm>
#include <cmath>

namespace pocd {
namespace {

constexpr int kSide = VoxelBlock::kSide;

std::int32_t block_of(std::int32_t voxel) {
  return voxel >= 0 ? voxel / kSide : -((kSide - 1 - voxel) / kSide);
}

}  // namespace

void ObservedRegion::add(const Frame& frame, int frames) {
  const CameraModel& camera = frame.camera;
  const double block_m = voxel_size_m_ * kSide;
  Eigen::Vector3d low = frame.T_W_C.translation(), high = low;
  for (const double u : {-0.5, camera.width - 0.5}) {
    for (const double v : {-0.5, camera.height - 0.5}) {
      const Eigen::Vector3d corner_W = frame.T_W_C * camera.back_project(u, v, max_depth_m_);
      low = low.cwiseMin(corner_W), high = high.cwiseMax(corner_W);
    }
  }
  const Pose T_C_W = frame.T_W_C.inverse();
  const Eigen::Array3i first = (low / block_m).array().floor().cast<int>();
  const Eigen::Array3i last = (high / block_m).array().floor().cast<int>();
  for (int bz = first.z(); bz <= last.z(); ++bz) {
    for (int by = first.y(); by <= last.y(); ++by) {
      for (int bx = first.x(); bx <= last.x(); ++bx) {
        const Eigen::Vector3d center_C =
            T_C_W * (Eigen::Vector3d(bx + 0.5, by + 0.5, bz + 0.5) * block_m);
        if (center_C.z() < -block_m || center_C.z() > max_depth_m_ + block_m) continue;
        Block* block = nullptr;
        for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
          const Eigen::Vector3d voxel(8 * bx + i % kSide + 0.5, 8 * by + (i / kSide) % kSide + 0.5,
                                      8 * bz + i / (kSide * kSide) + 0.5);
          const Eigen::Vector3d p_C = T_C_W * (voxel * voxel_size_m_);
          if (p_C.z() < 0.05 || p_C.z() > max_depth_m_) continue;
          const auto u =
              static_cast<int>(std::floor(p_C.x() / p_C.z() * camera.fx + camera.cx + 0.5));
          const auto v =
              static_cast<int>(std::floor(p_C.y() / p_C.z() * camera.fy + camera.cy + 0.5));
          if (u < 0 || v < 0 || u >= camera.width || v >= camera.height) continue;
          const float depth = frame.depth_m.at<float>(v, u);
          if (!(depth > 0.0f) || depth < p_C.z() - margin_m_) continue;
          if (!block) {
            const BlockKey key{bx, by, bz};
            const auto [place, fresh] = index_.try_emplace(key, blocks_.size());
            if (fresh) blocks_.push_back({key, {}});
            block = &blocks_[place->second];
          }
          Voxel& now = block->voxels[static_cast<std::size_t>(i)];
          std::uint16_t& count = depth <= p_C.z() + margin_m_ ? now.seen : now.seen_through;
          count = static_cast<std::uint16_t>(std::min(count + frames, 65535));
        }
      }
    }
  }
}

ObservedRegion::Voxel ObservedRegion::at(std::int32_t x, std::int32_t y, std::int32_t z) const {
  const BlockKey key{block_of(x), block_of(y), block_of(z)};
  const auto it = index_.find(key);
  if (it == index_.end()) return {};
  const int i = (x - kSide * key.x) + kSide * ((y - kSide * key.y) + kSide * (z - kSide * key.z));
  return blocks_[it->second].voxels[static_cast<std::size_t>(i)];
}

}  // namespace pocd
