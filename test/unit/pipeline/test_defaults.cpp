// A value that two structs have as default is one value.
#include <gtest/gtest.h>

#include "pocd/association/point_to_plane_icp.hpp"
#include "pocd/change/ray_traced_change.hpp"
#include "pocd/eval/scene_truth.hpp"
#include "pocd/eval/voxel_metrics.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/sim/truth.hpp"
#include "pocd/state/object_state.hpp"

namespace pocd {
namespace {

TEST(Defaults, HaveOneSource) {
  const PipelineConfig config;
  const Belief belief;
  EXPECT_EQ(belief.alpha, config.state.initial_stationarity * config.state.initial_count);
  EXPECT_EQ(belief.beta, (1.0 - config.state.initial_stationarity) * config.state.initial_count);
  EXPECT_EQ(belief.sigma, config.state.initial_sigma_m);
  EXPECT_EQ(IcpOptions{}.max_iterations, config.association.icp_iterations);
  EXPECT_EQ(RayTracedChangeOptions{}.truncation_m, config.change.tsdf_truncation_m);
  EXPECT_EQ(RayTracedChangeOptions{}.lambda_diff, config.change.lambda_diff);
  EXPECT_EQ(SceneTruthOptions{}.map_voxel_m, config.map.voxel_size_m);
  EXPECT_EQ(SceneTruthOptions{}.max_depth_m, config.map.max_depth_m);
  EXPECT_EQ(VisibleSurfaceOptions{}.voxel_size_m, config.map.voxel_size_m);
  EXPECT_EQ(VisibleSurfaceOptions{}.max_depth_m, config.map.max_depth_m);
  EXPECT_EQ(VoxelMetricsConfig{}.map_voxel_m, config.map.voxel_size_m);
  EXPECT_EQ(VoxelMetricsConfig{}.tolerance_m, config.map.voxel_size_m);
}

}  // namespace
}  // namespace pocd
