#include "pocd/map/tsdf_map.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "block_finder.hpp"
#include "block_store.hpp"
#include "pocd/common/check.hpp"
#include "tsdf_integrator.hpp"
#include "tsdf_kernel.hpp"

namespace pocd {

struct TsdfMap::Impl {
  explicit Impl(const TsdfConfig& c) : config(c), store(c.memory) {}

  // Blocks handed out by touch() may have got any owners since.
  void settle_touched() {
    for (const BlockKey& key : touched) {
      const std::uint32_t slot = store.find(key);
      if (slot != BlockStore::kNoSlot) store.note_owners(slot);
    }
    touched.clear();
  }

  TsdfConfig config;
  BlockStore store;
  TsdfIntegrator integrator;
  std::vector<BlockKey> touched;
};

TsdfMap::TsdfMap(const TsdfConfig& config) {
  if (!(config.voxel_size_m > 0.0 && config.truncation_voxels >= 1.0 && config.max_depth_m > 0.0 &&
        config.max_weight >= 1 && config.max_weight <= 1000)) {
    throw InputError(
        "map: voxel_size_m, truncation_voxels, max_depth_m or max_weight out of range");
  }
  impl_ = std::make_unique<Impl>(config);
}
TsdfMap::~TsdfMap() = default;
TsdfMap::TsdfMap(TsdfMap&&) noexcept = default;
TsdfMap& TsdfMap::operator=(TsdfMap&&) noexcept = default;

const TsdfConfig& TsdfMap::config() const { return impl_->config; }

void TsdfMap::integrate(const IntegrationInput& input, ThreadPool& pool) {
  impl_->settle_touched();
  impl_->store.begin_pass();
  impl_->integrator.integrate(impl_->config, input, impl_->store, pool);
  impl_->store.keep_budget();
}

void TsdfMap::check_view(const Frame& frame) const {
  pocd::check_view(impl_->config, frame.camera, frame.T_W_C);
}

std::size_t TsdfMap::clear_object(ObjectId id) {
  return clear_object_where(id, [](const Eigen::Vector3d&) { return true; });
}

std::size_t TsdfMap::clear_object_where(ObjectId id,
                                        const std::function<bool(const Eigen::Vector3d&)>& inside) {
  const std::uint32_t owner = to_index(id);
  if (owner == 0) return 0;
  impl_->settle_touched();
  const double voxel_m = impl_->config.voxel_size_m;
  std::size_t cleared = 0;
  for (const std::uint32_t slot : impl_->store.take_owner(owner)) {
    VoxelBlock& block = impl_->store.block(slot);
    std::size_t here = 0;
    bool surface = false, kept = false;
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      if (block.owner[i] == owner) {
        const Eigen::Vector3d center_W =
            (8.0 * Eigen::Vector3d(block.key.x, block.key.y, block.key.z) +
             Eigen::Vector3d((i & 7) + 0.5, (i >> 3 & 7) + 0.5, (i >> 6) + 0.5)) *
            voxel_m;
        if (inside(center_W)) {
          block.tsdf[i] = 0;
          block.weight[i] = 0;
          block.owner[i] = 0;
          ++here;
        } else {
          kept = true;
        }
      }
      surface |= block.weight[i] > 0 && block.tsdf[i] < kFreeTsdf;
    }
    if (kept) impl_->store.note_owner(slot, owner);
    if (here == 0) continue;
    cleared += here;
    impl_->store.mark_dirty(slot);
    if (!surface) impl_->store.drop(slot);
  }
  return cleared;
}

std::size_t TsdfMap::clear_column(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                                  const std::function<bool(const Eigen::Vector2d&)>& inside) {
  impl_->settle_touched();
  const double voxel_m = impl_->config.voxel_size_m;
  std::size_t cleared = 0;
  for (const BlockKey& key : keys_by_region()) {
    const Eigen::Vector2d corner = Eigen::Vector2d(key.x, key.y) * (8.0 * voxel_m);
    if ((corner.array() > high.array()).any() ||
        (corner.array() + 8.0 * voxel_m < low.array()).any()) {
      continue;
    }
    impl_->store.begin_pass();
    BlockStore::Region* region = impl_->store.region(key.region());
    if (region == nullptr) continue;  // lost when it was to be read
    impl_->store.enter(*region);
    const std::uint32_t slot = impl_->store.find(key);
    if (slot == BlockStore::kNoSlot) continue;
    VoxelBlock& block = impl_->store.block(slot);
    std::size_t here = 0;
    bool surface = false;
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const Eigen::Vector2d center =
          corner + Eigen::Vector2d((i & 7) + 0.5, (i >> 3 & 7) + 0.5) * voxel_m;
      if (block.weight[i] > 0 && inside(center)) {
        block.tsdf[i] = 0;
        block.weight[i] = 0;
        block.owner[i] = 0;
        ++here;
      }
      surface |= block.weight[i] > 0 && block.tsdf[i] < kFreeTsdf;
    }
    if (here == 0) continue;
    cleared += here;
    impl_->store.mark_dirty(slot);
    if (!surface) impl_->store.drop(slot);
  }
  return cleared;
}

void TsdfMap::clear() {
  impl_->touched.clear();
  impl_->store.clear();
}

std::size_t TsdfMap::reassign_object(ObjectId from, ObjectId to) {
  if (from == to) return 0;
  impl_->settle_touched();
  std::size_t changed = 0;
  for (const std::uint32_t slot : impl_->store.take_owner(to_index(from))) {
    std::size_t here = 0;
    for (std::uint32_t& owner : impl_->store.block(slot).owner) {
      if (owner != to_index(from)) continue;
      owner = to_index(to);
      ++here;
    }
    if (here == 0) continue;
    changed += here;
    impl_->store.note_owner(slot, to_index(to));
    impl_->store.mark_dirty(slot);
  }
  return changed;
}

std::size_t TsdfMap::block_count() const { return impl_->store.size(); }

const VoxelBlock* TsdfMap::find(const BlockKey& key) const {
  const std::uint32_t slot = impl_->store.find(key);
  if (slot != BlockStore::kNoSlot) return &impl_->store.block(slot);
  POCD_CHECK(!impl_->store.contains(key));
  return nullptr;
}

std::optional<double> TsdfMap::distance_at(const Eigen::Vector3f& point_W, int min_weight,
                                           const MapEdits& pending) {
  const TsdfConfig& config = impl_->config;
  const Eigen::Array3i voxel =
      (point_W.array() / static_cast<float>(config.voxel_size_m)).floor().cast<int>();
  const BlockKey key{voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3};
  std::uint32_t slot = impl_->store.find(key);
  if (slot == BlockStore::kNoSlot && impl_->store.contains(key)) {
    impl_->store.enter(*impl_->store.region(key.region()));
    slot = impl_->store.find(key);
  }
  if (slot == BlockStore::kNoSlot) return std::nullopt;
  const int i = (voxel.x() & 7) + 8 * ((voxel.y() & 7) + 8 * (voxel.z() & 7));
  const VoxelBlock& block = impl_->store.block(slot);
  if (block.weight[i] < min_weight) return std::nullopt;
  if (!pending.empty()) {
    const Eigen::Vector3d center_W = (voxel.cast<double>() + 0.5) * config.voxel_size_m;
    if (pending.clears(ObjectId{block.owner[i]}, center_W)) return std::nullopt;
  }
  return block.tsdf[i] / static_cast<double>(kTsdfScale) * config.truncation_m();
}

VoxelBlock& TsdfMap::touch(const BlockKey& key) {
  impl_->store.begin_pass();
  const std::uint32_t slot = impl_->store.find_or_allocate(key);
  impl_->store.mark_dirty(slot);
  impl_->touched.push_back(key);
  return impl_->store.block(slot);
}

std::vector<BlockKey> TsdfMap::sorted_keys() const { return impl_->store.sorted_keys(); }

std::vector<BlockKey> TsdfMap::keys_by_region() const {
  std::vector<BlockKey> keys = sorted_keys();
  std::stable_sort(keys.begin(), keys.end(),
                   [](const BlockKey& a, const BlockKey& b) { return a.region() < b.region(); });
  return keys;
}

std::vector<BlockKey> TsdfMap::take_dirty() { return impl_->store.take_dirty(); }

void TsdfMap::keep_unsaved() { impl_->store.keep_unsaved(); }
std::vector<BlockKey> TsdfMap::take_unsaved() { return impl_->store.take_unsaved(); }

void TsdfMap::restore(const std::vector<StoredRegion>& regions,
                      std::shared_ptr<RegionSource> source) {
  POCD_CHECK(block_count() == 0);
  impl_->store.restore(regions, std::move(source));
}

void TsdfMap::recall(const BlockKey& key) {
  impl_->store.begin_pass();
  if (BlockStore::Region* region = impl_->store.region(key.region())) impl_->store.enter(*region);
}

MapMemoryStatus TsdfMap::memory_status() const { return impl_->store.memory_status(); }

std::optional<std::string> TsdfMap::take_problem() { return impl_->store.take_problem(); }

MapVisits TsdfMap::visits() const { return impl_->store.visits(); }

const BlockStore& TsdfMap::store() const { return impl_->store; }

}  // namespace pocd
