// Integration, publication and mesh of real frames, every fifth of redkitchen. Skipped, saying so,
// where the recording is not there. OpenCV is beside the integration in suite_integration.cpp.
#include <benchmark/benchmark.h>

#include "frame_set.hpp"
#include "pocd/map/map_delta.hpp"
#include "pocd/map/mesh.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "statistics.hpp"

namespace pocd {
namespace {

struct OwnedFrame {
  Frame frame;
  std::vector<std::uint32_t> owners;

  IntegrationInput input() const {
    return {&frame, owners.data(), frame.camera.width / bench::kOwnerStride,
            frame.camera.height / bench::kOwnerStride, bench::kOwnerStride};
  }
};

const std::vector<OwnedFrame>& frames() {
  static const std::vector<OwnedFrame> loaded = [] {
    std::vector<OwnedFrame> some;
    const bench::FrameSet set = bench::load_redkitchen(300);
    for (std::size_t i = 0; i < set.frames.size(); i += 5) {
      some.push_back({set.frames[i], bench::made_up_owners(set.frames[i])});
    }
    return some;
  }();
  return loaded;
}

TsdfConfig config_of(const benchmark::State& state) {
  TsdfConfig config;
  config.voxel_size_m = 1e-3 * static_cast<double>(state.range(0));
  config.max_depth_m = 4.0;
  return config;
}

// range: voxel size [mm], threads
void BM_Integrate(benchmark::State& state) {
  if (frames().empty()) return state.SkipWithError("POCD_TEST_DATA has no redkitchen");
  ThreadPool pool(static_cast<int>(state.range(1)));
  TsdfMap map(config_of(state));
  for (const OwnedFrame& f : frames()) map.integrate(f.input(), pool);
  std::size_t next = 0;
  for (auto _ : state) map.integrate(frames()[next++ % frames().size()].input(), pool);
  state.counters["blocks"] = static_cast<double>(map.block_count());
}
BENCHMARK(BM_Integrate)
    ->ArgsProduct({{50, 20}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BM_PublishAndMesh(benchmark::State& state) {
  if (frames().empty()) return state.SkipWithError("POCD_TEST_DATA has no redkitchen");
  ThreadPool pool(1);
  const TsdfConfig config = config_of(state);
  TsdfMap map(config);
  for (const OwnedFrame& f : frames()) map.integrate(f.input(), pool);
  std::size_t bytes = 0, triangles = 0, tiles = 0;
  double publish_ms = 0.0;
  for (auto _ : state) {
    for (const BlockKey& key : map.sorted_keys()) map.touch(key);
    MapPublisher publisher(1, config);
    const double start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    publisher.update(map);
    publish_ms = clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start;
    triangles = extract_mesh(map, config.min_publish_weight, pool).triangles.size();
    tiles = publisher.tiles().size();
    bytes = 0;
    for (const auto& entry : publisher.tiles()) bytes += entry.second.payload.size();
  }
  state.counters["tiles"] = static_cast<double>(tiles);
  state.counters["bytes_per_tile"] = static_cast<double>(bytes) / static_cast<double>(tiles);
  state.counters["publish_ms"] = publish_ms;
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(BM_PublishAndMesh)->Arg(50)->Arg(20)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pocd
