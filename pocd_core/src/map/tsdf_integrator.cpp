#include "tsdf_integrator.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Blocks per piece of work: about 5 microseconds, above the cost of handing it out, and little to
// wait for at the end.
constexpr std::size_t kGrain = 2;

void check_input(const IntegrationInput& input) {
  POCD_CHECK(input.frame != nullptr);
  const Frame& frame = *input.frame;
  POCD_CHECK(frame.depth_m.type() == CV_32FC1);
  POCD_CHECK(frame.depth_m.cols == frame.camera.width && frame.depth_m.rows == frame.camera.height);
  if (input.owners) {
    POCD_CHECK(input.owner_stride >= 1 && input.owner_width >= 1 && input.owner_height >= 1);
  }
}

}  // namespace

void TsdfIntegrator::prepare(const TsdfConfig& config, const IntegrationInput& input) {
  const Frame& frame = *input.frame;
  const CameraModel& camera = frame.camera;
  KernelFrame& k = kernel_;
  k.depth = frame.depth_m.ptr<float>();
  k.depth_stride = static_cast<int>(frame.depth_m.step1());
  k.width = static_cast<float>(camera.width);
  k.height = static_cast<float>(camera.height);
  k.fx = static_cast<float>(camera.fx);
  k.fy = static_cast<float>(camera.fy);
  k.cx = static_cast<float>(camera.cx);
  k.cy = static_cast<float>(camera.cy);
  k.owners = input.owners ? input.owners : &no_owner_;
  k.owner_stride = input.owners ? input.owner_width : 0;
  k.owner_max_u = input.owners ? static_cast<float>(input.owner_width - 1) : 0.0f;
  k.owner_max_v = input.owners ? static_cast<float>(input.owner_height - 1) : 0.0f;
  k.owner_scale = input.owners ? 1.0f / static_cast<float>(input.owner_stride) : 0.0f;
  k.max_depth = static_cast<float>(config.max_depth_m);
  k.clear_depth = config.clear_beyond_limit ? k.max_depth : 0.0f;
  k.truncation = static_cast<float>(config.truncation_m());
  k.owner_band = kOwnerBandVoxels * static_cast<float>(config.voxel_size_m);
  k.voxel = static_cast<float>(config.voxel_size_m);
  k.max_weight = static_cast<float>(config.max_weight);
  const Eigen::Matrix3d R_C_W = frame.T_W_C.linear().transpose();
  int i = 0;
  for (int z = 0; z < VoxelBlock::kSide; ++z) {
    for (int y = 0; y < VoxelBlock::kSide; ++y) {
      for (int x = 0; x < VoxelBlock::kSide; ++x, ++i) {
        const Eigen::Vector3d center_C =
            R_C_W * (Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) * config.voxel_size_m);
        k.offset_x[i] = static_cast<float>(center_C.x());
        k.offset_y[i] = static_cast<float>(center_C.y());
        k.offset_z[i] = static_cast<float>(center_C.z());
      }
    }
  }
}

void TsdfIntegrator::integrate(const TsdfConfig& config, const IntegrationInput& input,
                               BlockStore& store, ThreadPool& pool) {
  check_input(input);
  pool.rouse();
  prepare(config, input);
  finder_.scan(config, input, pool);

  slots_.clear();
  for (const BlockKey& key : finder_.band()) slots_.push_back(store.find_or_allocate(key));
  finder_.append_seen(store, pool, slots_);

  outcomes_.resize(slots_.size());
  const Pose T_C_W = input.frame->T_W_C.inverse();
  const double block_m = config.voxel_size_m * VoxelBlock::kSide;
  pool.parallel_for(slots_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      VoxelBlock& block = store.block(slots_[n]);
      const Eigen::Vector3d corner_W =
          Eigen::Vector3d(block.key.x, block.key.y, block.key.z) * block_m;
      const Eigen::Vector3f corner_C = (T_C_W * corner_W).cast<float>();
      BlockOutcome& outcome = outcomes_[n];
      outcome = integrate_block(kernel_, corner_C.x(), corner_C.y(), corner_C.z(), block);
      outcome.notes_owners = outcome.owner_any == outcome.owner_all
                                 ? store.lacks_owner(slots_[n], outcome.owner_any)
                                 : outcome.owner_any != 0 && store.lacks_owners(slots_[n]);
    }
  });
  settle(store);
}

void TsdfIntegrator::settle(BlockStore& store) {
  for (std::size_t n = 0; n < slots_.size(); ++n) {
    const std::uint32_t slot = slots_[n];
    const BlockOutcome& outcome = outcomes_[n];
    if (!outcome.has_surface) {
      store.drop(slot);
      continue;
    }
    if (!outcome.changed) continue;
    store.mark_dirty(slot);
    if (!outcome.notes_owners) continue;
    if (outcome.owner_any == outcome.owner_all) {
      store.note_owner(slot, outcome.owner_any);
    } else {
      store.note_owners(slot);
    }
  }
}

}  // namespace pocd
