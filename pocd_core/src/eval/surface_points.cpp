#include "pocd/eval/surface_points.hpp"

#include "pocd/map/map_reader.hpp"
#include "zero_crossings.hpp"

namespace pocd {

Points surface_points(const TsdfMap& map, int min_weight) {
  constexpr float kScale = 1.0f / 32767.0f;
  MapReader reader(map);
  const auto block_at = [&](const BlockKey& key) { return reader.find(key); };
  const auto value = [&](const VoxelBlock& block, int i, float& v) {
    v = static_cast<float>(block.tsdf[static_cast<std::size_t>(i)]) * kScale;
    return block.weight[static_cast<std::size_t>(i)] >= min_weight;
  };
  return zero_crossings<VoxelBlock>(map.keys_by_region(), map.config().voxel_size_m, block_at,
                                    value);
}

}  // namespace pocd
