// Alignment and assignment. PCL's registration is beside the alignment in suite_icp.cpp.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "icp_scene.hpp"
#include "pocd/eval/assignment.hpp"

namespace pocd {
namespace {

using bench::IcpScene;
using bench::kInlier_m;
using bench::kReach_m;

void BM_Icp(benchmark::State& state) {
  const IcpScene scene(static_cast<int>(state.range(0)));
  IcpOptions options;
  options.freedom = state.range(1) == 4 ? IcpFreedom::kYaw : IcpFreedom::kFull;
  const IcpTarget target(scene.object.points, scene.object.normals, kInlier_m, kReach_m);
  IcpResult result;
  for (auto _ : state) result = point_to_plane_icp(target, scene.observed, options);
  state.counters["error_mm"] = scene.error_mm(result.T_target_source);
  state.counters["iterations"] = result.iterations;
}
BENCHMARK(BM_Icp)->ArgsProduct({{1000, 2000, 5000}, {4, 6}})->Unit(benchmark::kMillisecond);

void BM_IcpTargetBuild(benchmark::State& state) {
  const IcpScene scene(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        IcpTarget(scene.object.points, scene.object.normals, kInlier_m, kReach_m));
  }
}
BENCHMARK(BM_IcpTargetBuild)->Arg(1000)->Arg(2000)->Arg(5000)->Unit(benchmark::kMillisecond);

// n objects and observations, each with about four candidates.
void BM_Assign(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  Random random(2);
  std::vector<AssignmentCandidate> candidates;
  for (int r = 0; r < n; ++r) {
    for (int c = std::max(0, r - 2); c < std::min(n, r + 2); ++c) {
      candidates.push_back({r, c, random.uniform(0.0, 4.0)});
    }
  }
  for (auto _ : state) benchmark::DoNotOptimize(assign(candidates, 3.6));
}
BENCHMARK(BM_Assign)->Arg(10)->Arg(50)->Arg(200)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace pocd
