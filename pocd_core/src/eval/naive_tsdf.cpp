#include "naive_tsdf.hpp"

#include <algorithm>
#include <cmath>

#include "zero_crossings.hpp"

namespace pocd {
namespace {

constexpr int kSide = VoxelBlock::kSide;
constexpr int kAllocationStride_px = 2;

}  // namespace

NaiveTsdf::Block& NaiveTsdf::block_at(const BlockKey& key) {
  const auto [place, fresh] = index_.try_emplace(key, blocks_.size());
  if (fresh) {
    blocks_.push_back(std::make_unique<Block>());
    blocks_.back()->key = key;
  }
  return *blocks_[place->second];
}

void NaiveTsdf::allocate(const Frame& frame, const cv::Mat& mask) {
  const double block_m = config_.voxel_size_m * kSide;
  const double truncation_m = config_.truncation_m();
  BlockKey last{INT32_MAX, 0, 0};
  for (int v = 0; v < frame.depth_m.rows; v += kAllocationStride_px) {
    const float* depth = frame.depth_m.ptr<float>(v);
    const std::uint8_t* use = mask.empty() ? nullptr : mask.ptr<std::uint8_t>(v);
    for (int u = 0; u < frame.depth_m.cols; u += kAllocationStride_px) {
      const float z = depth[u];
      if (!(z > 0.0f) || z > config_.max_depth_m || (use && use[u] < kUse)) continue;
      const Eigen::Vector3d ray_W = frame.T_W_C.linear() * frame.camera.back_project(u, v, 1.0);
      // Steps of half a block along the band leave out corners only that neighbouring rays hit.
      for (double s = -truncation_m; s <= truncation_m + 1e-9; s += truncation_m / 2.0) {
        const Eigen::Vector3d p = (frame.T_W_C.translation() + ray_W * (z + s)) / block_m;
        const BlockKey key{static_cast<std::int32_t>(std::floor(p.x())),
                           static_cast<std::int32_t>(std::floor(p.y())),
                           static_cast<std::int32_t>(std::floor(p.z()))};
        if (key == last) continue;
        block_at(key);
        last = key;
      }
    }
  }
}

void NaiveTsdf::integrate(const Frame& frame, const cv::Mat& mask) {
  allocate(frame, mask);
  const auto voxel_m = static_cast<float>(config_.voxel_size_m);
  const auto truncation_m = static_cast<float>(config_.truncation_m());
  const auto max_depth_m = static_cast<float>(config_.max_depth_m);
  const CameraModel& camera = frame.camera;
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx) + 0.5f, cy = static_cast<float>(camera.cy) + 0.5f;
  const Pose T_C_W = frame.T_W_C.inverse();
  const Eigen::Matrix3f R = (T_C_W.linear() * config_.voxel_size_m).cast<float>();
  const float block_radius_m = voxel_m * kSide * 0.867f;  // half of its diagonal
  for (const auto& block : blocks_) {
    const Eigen::Vector3d corner_W =
        Eigen::Vector3d(block->key.x, block->key.y, block->key.z) * (config_.voxel_size_m * kSide);
    const Eigen::Vector3f corner_C = (T_C_W * corner_W).cast<float>();
    const Eigen::Vector3f center_C = corner_C + R * Eigen::Vector3f::Constant(kSide / 2.0f);
    const float z = center_C.z();
    if (z < -block_radius_m || z > max_depth_m + truncation_m + block_radius_m) continue;
    const float reach = std::max(z, 0.0f) + block_radius_m;
    if (std::abs(center_C.x()) >
            reach * static_cast<float>(camera.width) / fx + 2.0f * block_radius_m ||
        std::abs(center_C.y()) >
            reach * static_cast<float>(camera.height) / fy + 2.0f * block_radius_m) {
      continue;
    }
    int i = 0;
    for (int bz = 0; bz < kSide; ++bz) {
      for (int by = 0; by < kSide; ++by) {
        for (int bx = 0; bx < kSide; ++bx, ++i) {
          const Eigen::Vector3f p = corner_C + R * Eigen::Vector3f(static_cast<float>(bx) + 0.5f,
                                                                   static_cast<float>(by) + 0.5f,
                                                                   static_cast<float>(bz) + 0.5f);
          if (p.z() < 0.01f) continue;
          const float u = p.x() / p.z() * fx + cx, v = p.y() / p.z() * fy + cy;
          if (u < 0.0f || v < 0.0f || u >= static_cast<float>(camera.width) ||
              v >= static_cast<float>(camera.height)) {
            continue;
          }
          const int col = static_cast<int>(u), row = static_cast<int>(v);
          const float depth = frame.depth_m.at<float>(row, col);
          if (!(depth > 0.0f)) continue;
          if (!mask.empty() && mask.at<std::uint8_t>(row, col) == 0) continue;
          const float s = depth - p.z();
          if (s < -truncation_m) continue;
          // Voxblox too clears with rays that end beyond the limit.
          if (depth > max_depth_m && (s < truncation_m || p.z() > max_depth_m)) continue;
          const float range_m = std::min(depth, max_depth_m);
          float weight = 1.0f / (range_m * range_m);
          if (s < -voxel_m) weight *= (truncation_m + s) / (truncation_m - voxel_m);
          if (weight <= 0.0f) continue;
          const auto n = static_cast<std::size_t>(i);
          const float total = block->weight[n] + weight;
          block->distance[n] =
              (block->distance[n] * block->weight[n] + std::min(s / truncation_m, 1.0f) * weight) /
              total;
          block->weight[n] = std::min(total, max_weight_);
        }
      }
    }
  }
}

Points NaiveTsdf::surface(float min_weight) const {
  std::vector<BlockKey> keys;
  for (const auto& block : blocks_) keys.push_back(block->key);
  std::sort(keys.begin(), keys.end());
  const auto find = [&](const BlockKey& key) -> const Block* {
    const auto it = index_.find(key);
    return it == index_.end() ? nullptr : blocks_[it->second].get();
  };
  const auto value = [&](const Block& block, int i, float& v) {
    v = block.distance[static_cast<std::size_t>(i)];
    return block.weight[static_cast<std::size_t>(i)] >= min_weight;
  };
  return zero_crossings<Block>(keys, config_.voxel_size_m, find, value);
}

void NaiveTsdf::merge(const NaiveTsdf& other) {
  for (const auto& from : other.blocks_) {
    Block& to = block_at(from->key);
    for (std::size_t i = 0; i < to.weight.size(); ++i) {
      const float total = to.weight[i] + from->weight[i];
      if (from->weight[i] <= 0.0f) continue;
      to.distance[i] =
          (to.distance[i] * to.weight[i] + from->distance[i] * from->weight[i]) / total;
      to.weight[i] = std::min(total, max_weight_);
    }
  }
}

bool NaiveTsdf::distance_at(const Eigen::Vector3f& point_W, float min_weight,
                            float& distance) const {
  const Eigen::Vector3f voxel = point_W / static_cast<float>(config_.voxel_size_m);
  const Eigen::Array3i n = voxel.array().floor().cast<int>();
  const auto down = [](int a) { return a >= 0 ? a / kSide : -((kSide - 1 - a) / kSide); };
  const BlockKey key{down(n.x()), down(n.y()), down(n.z())};
  const auto it = index_.find(key);
  if (it == index_.end()) return false;
  const Block& block = *blocks_[it->second];
  const int i =
      (n.x() - kSide * key.x) + kSide * ((n.y() - kSide * key.y) + kSide * (n.z() - kSide * key.z));
  distance = block.distance[static_cast<std::size_t>(i)];
  return block.weight[static_cast<std::size_t>(i)] >= min_weight;
}

}  // namespace pocd
