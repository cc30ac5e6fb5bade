// The published change measure, for a box wall filling the view.
#include <benchmark/benchmark.h>

#include "pocd/common/random.hpp"
#include "pocd/eval/ray_traced_change.hpp"

namespace pocd {
namespace {

// About `count` points of a 1 x 1 m wall at depth `z` in the optical frame.
Points wall(int count, double z) {
  Random random(1);
  Points points;
  for (int i = 0; i < count; ++i) {
    points.push_back(Eigen::Vector3d(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5),
                                     z + 0.005 * random.normal())
                         .cast<float>());
  }
  return points;
}

void BM_RayTracedChange(benchmark::State& state) {
  const Points object = wall(static_cast<int>(state.range(0)), 1.5);
  const Points observation = wall(static_cast<int>(state.range(0)), 1.4);
  for (auto _ : state) {
    benchmark::DoNotOptimize(ray_traced_change(object, observation, -0.1, {}));
  }
}
BENCHMARK(BM_RayTracedChange)->Arg(1000)->Arg(5000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pocd
