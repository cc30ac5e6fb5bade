#include "reference_integrator.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "map_fixtures.hpp"

namespace pocd::testing {
namespace {

// The numbers that the map documents.
constexpr int kFree = 29490;           // 0.9 of the truncation distance, times 32767
constexpr float kFreeWeight = 8.0f;    // cap of the weight of free space
constexpr float kOwnerVoxels = 1.75f;  // band that takes the pixel's owner
constexpr int kEdgeGuard = 2;          // pixels
constexpr float kConflictVoxels = 2.0f;  // a change of sides by so much halves the weight
constexpr float kBehindVoxels = 1.25f;   // so far behind a surface, known free space stays free
constexpr int kKnownFreeWeight = 3;

struct Seen {
  bool valid = false;
  int u = 0, v = 0;
  float z = 0.0f, distance = 0.0f;
  std::uint32_t owner = 0;
};

Seen look_up(const IntegrationInput& input, const TsdfConfig& config, float x, float y, float z) {
  const float max_depth = static_cast<float>(config.max_depth_m);
  const CameraModel& camera = input.frame->camera;
  Seen seen;
  seen.z = z;
  if (!(z > 0.01f)) return seen;
  const float inverse = 1.0f / z;
  const float u =
      x * inverse * static_cast<float>(camera.fx) + (static_cast<float>(camera.cx) + 0.5f);
  const float v =
      y * inverse * static_cast<float>(camera.fy) + (static_cast<float>(camera.cy) + 0.5f);
  if (!(u >= 0.0f && u < static_cast<float>(camera.width) && v >= 0.0f &&
        v < static_cast<float>(camera.height))) {
    return seen;
  }
  seen.u = static_cast<int>(u);
  seen.v = static_cast<int>(v);
  const float depth = input.frame->depth_m.at<float>(seen.v, seen.u);
  seen.owner = input.owners ? input.owners[(seen.v / input.owner_stride) * input.owner_width +
                                           seen.u / input.owner_stride]
                            : 0;
  seen.distance = depth - z;
  const bool clear = config.clear_beyond_limit && z <= max_depth &&
                     seen.distance >= static_cast<float>(config.truncation_m());
  seen.valid =
      depth > 0.0f && (depth <= max_depth || clear) && seen.owner != IntegrationInput::kSkip;
  return seen;
}

bool beside_an_edge(const IntegrationInput& input, const Seen& seen, float truncation) {
  const cv::Mat& depth = input.frame->depth_m;
  for (int v = std::max(0, seen.v - kEdgeGuard); v <= std::min(depth.rows - 1, seen.v + kEdgeGuard);
       ++v) {
    for (int u = std::max(0, seen.u - kEdgeGuard);
         u <= std::min(depth.cols - 1, seen.u + kEdgeGuard); ++u) {
      const float d = depth.at<float>(v, u);
      if (d > 0.0f && d - seen.z < truncation) return true;
    }
  }
  return false;
}

}  // namespace

void ReferenceIntegrator::fuse(const IntegrationInput& input, VoxelBlock& block) const {
  const float truncation = static_cast<float>(config_.truncation_m());
  const float scale = 32767.0f / truncation;
  const float band = kOwnerVoxels * static_cast<float>(config_.voxel_size_m);
  const float cap = static_cast<float>(config_.max_weight);
  const Pose T_C_W = input.frame->T_W_C.inverse();
  const Eigen::Vector3f corner = (T_C_W * (Eigen::Vector3d(block.key.x, block.key.y, block.key.z) *
                                           8.0 * config_.voxel_size_m))
                                     .cast<float>();
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    const Eigen::Vector3f offset =
        (T_C_W.linear() * (Eigen::Vector3d((i & 7) + 0.5, (i >> 3 & 7) + 0.5, (i >> 6) + 0.5) *
                           config_.voxel_size_m))
            .cast<float>();
    const Seen seen = look_up(input, config_, corner.x() + offset.x(), corner.y() + offset.y(),
                              corner.z() + offset.z());
    if (!seen.valid || seen.distance < -truncation) continue;
    std::int16_t& tsdf = block.tsdf[i];
    std::uint16_t& weight = block.weight[i];
    std::uint32_t& owner = block.owner[i];
    const bool unknown = weight == 0;
    const bool empty = unknown || tsdf >= kFree;
    if (seen.distance >= truncation && !unknown && tsdf < kFree) {  // the surface has gone
      if (beside_an_edge(input, seen, truncation)) continue;
      const int w = weight / 2;
      tsdf = static_cast<std::int16_t>((tsdf * w + 32767) / (w + 1));
      weight = static_cast<std::uint16_t>(std::max(w, 1));
      if (tsdf >= kFree) {
        weight = static_cast<std::uint16_t>(std::min(cap, kFreeWeight));
        owner = 0;
      }
      continue;
    }
    const float voxel = static_cast<float>(config_.voxel_size_m);
    const bool far_behind = seen.distance < -kBehindVoxels * voxel;
    if (far_behind && tsdf >= kFree && weight >= kKnownFreeWeight) continue;
    const float target = std::min(seen.distance, truncation) * scale;
    const bool changes_sides = (target < 0.0f) != (tsdf < 0);
    const bool by_much =
        std::abs(target - static_cast<float>(tsdf)) >= kConflictVoxels * voxel * scale;
    const float w =
        static_cast<float>(weight) * (changes_sides && by_much && !far_behind ? 0.5f : 1.0f);
    const float mean = (static_cast<float>(tsdf) * w + target) / (w + 1.0f);
    tsdf = static_cast<std::int16_t>(static_cast<int>(mean + 32768.5f) - 32768);
    const bool free = tsdf >= kFree;
    weight =
        static_cast<std::uint16_t>(std::min(w + 1.0f, free ? std::min(cap, kFreeWeight) : cap));
    if (free) {
      owner = 0;
    } else if (std::abs(seen.distance) <= band || (empty && seen.distance < 0.0f)) {
      owner = seen.owner;
    }
  }
}

void ReferenceIntegrator::integrate(const IntegrationInput& input,
                                    const std::vector<BlockKey>& allocated) {
  for (const BlockKey& key : allocated) blocks_[key].key = key;
  for (auto it = blocks_.begin(); it != blocks_.end();) {
    VoxelBlock& block = it->second;
    fuse(input, block);
    bool surface = false;
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      surface |= block.weight[i] > 0 && block.tsdf[i] < kFree;
    }
    it = surface ? std::next(it) : blocks_.erase(it);
  }
}

std::vector<BlockKey> blocks_near_surface(const TsdfConfig& config, const IntegrationInput& input,
                                          double band_voxels) {
  const CameraModel& camera = input.frame->camera;
  const Pose& T_W_C = input.frame->T_W_C;
  const Pose T_C_W = T_W_C.inverse();
  const double voxel_m = config.voxel_size_m;
  // Every voxel within two bands of some measured point is a candidate.
  std::set<BlockKey> near;
  const int reach = static_cast<int>(std::ceil(2.0 * band_voxels));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double depth = input.frame->depth_m.at<float>(v, u);
      if (!(depth > 0.0 && depth <= config.max_depth_m)) continue;
      const Eigen::Vector3d p_W = T_W_C * camera.back_project(u, v, depth);
      const Eigen::Vector3i at = (p_W / voxel_m).array().floor().cast<int>();
      for (int k = 0; k < (2 * reach + 1) * (2 * reach + 1) * (2 * reach + 1); ++k) {
        const int side = 2 * reach + 1;
        const Eigen::Vector3i voxel =
            at +
            Eigen::Vector3i(k % side - reach, k / side % side - reach, k / side / side - reach);
        const BlockKey key{voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3};
        if (near.count(key)) continue;
        const Eigen::Vector3f c =
            (T_C_W * ((voxel.cast<double>().array() + 0.5) * voxel_m).matrix()).cast<float>();
        const Seen seen = look_up(input, config, c.x(), c.y(), c.z());
        if (seen.valid && std::abs(seen.distance) <= band_voxels * voxel_m) near.insert(key);
      }
    }
  }
  return {near.begin(), near.end()};
}

}  // namespace pocd::testing
