// Belief update.
#include <benchmark/benchmark.h>

#include <vector>

#include "pocd/belief/bayesian_update.hpp"
#include "pocd/common/random.hpp"

namespace pocd {
namespace {

void BM_BayesianUpdate(benchmark::State& state) {
  Random random(1);
  std::vector<Measurement> measurements(1024);
  for (auto& z : measurements) z = {random.uniform(-4.0, 4.0), 0, 0.2, 3.0};
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(bayesian_update({0.0, 0.5, 6.7, 3.3}, measurements[i++ & 1023], 4.0));
  }
}
BENCHMARK(BM_BayesianUpdate);

void BM_AdaptiveK(benchmark::State& state) {
  const Belief prior{0.0, 0.5, 6.7, 3.3};
  double delta = 0.0;
  for (auto _ : state) {
    delta = delta > 4.0 ? 0.0 : delta + 0.01;
    benchmark::DoNotOptimize(adaptive_k(prior, {delta, 0, 0.2, 0.0}, 4.0));
  }
}
BENCHMARK(BM_AdaptiveK);

}  // namespace
}  // namespace pocd
