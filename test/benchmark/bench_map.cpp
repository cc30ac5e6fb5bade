// Integration of real frames, beside OpenCV's hash TSDF on the same frames, in turns, so that the
// drift of the machine hits both. POCD_TEST_DATA in the environment names the folder that holds
// redkitchen; without it these benchmarks say so and are skipped.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "pocd/map/map_delta.hpp"
#include "pocd/map/mesh.hpp"
#include "pocd/map/tsdf_map.hpp"
#ifdef POCD_HAS_OPENCV_RGBD
#include <opencv2/core/ocl.hpp>
#include <opencv2/rgbd/volume.hpp>
#endif

namespace pocd {
namespace {

constexpr double kMaxDepth_m = 4.0;
constexpr int kOwnerStride = 2;

struct RealFrame {
  Frame frame;
  std::vector<std::uint32_t> owners;

  IntegrationInput input() const {
    return {&frame, owners.data(), frame.camera.width / kOwnerStride,
            frame.camera.height / kOwnerStride, kOwnerStride};
  }
};

double cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Every fifth frame. Owners as a tracker would give them: things of half a metre, a third of them
// objects, that keep their owner from frame to frame.
std::vector<RealFrame> load_frames() {
  const char* set = std::getenv("POCD_TEST_DATA");
  const std::string folder = std::string(set ? set : POCD_TEST_DATA) + "/redkitchen/";
  std::vector<RealFrame> frames;
  for (int i = 0; i < 300; i += 5) {
    char name[32];
    std::snprintf(name, sizeof name, "frame-%06d", i);
    const cv::Mat depth = cv::imread(folder + name + ".depth.png", cv::IMREAD_UNCHANGED);
    std::ifstream in(folder + name + ".pose.txt");
    Eigen::Matrix4d m;
    for (int k = 0; k < 16; ++k) in >> m(k / 4, k % 4);
    if (depth.empty() || !in) return {};
    Pose T_W_C = Pose::Identity();
    T_W_C.linear() = Eigen::Quaterniond(m.topLeftCorner<3, 3>()).normalized().toRotationMatrix();
    T_W_C.translation() = m.topRightCorner<3, 1>();
    RealFrame real;
    real.frame = make_frame(i, {640, 480, 585, 585, 320, 240}, T_W_C, depth, {}, {}, name);
    for (int v = 0; v < 480; v += kOwnerStride) {
      for (int u = 0; u < 640; u += kOwnerStride) {
        const double z = real.frame.depth_m.at<float>(v, u);
        const Eigen::Vector3d cell =
            (T_W_C * real.frame.camera.back_project(u, v, z) / 0.5).array().floor();
        const int id = static_cast<int>(cell.x() + 40 * (cell.y() + 40 * cell.z()) + 80000);
        real.owners.push_back(id % 3 == 0 ? static_cast<std::uint32_t>(id) : 0u);
      }
    }
    frames.push_back(std::move(real));
  }
  return frames;
}

const std::vector<RealFrame>& frames() {
  static const std::vector<RealFrame> loaded = load_frames();
  return loaded;
}

TsdfConfig config_of(const benchmark::State& state) {
  TsdfConfig config;
  config.voxel_size_m = 1e-3 * static_cast<double>(state.range(0));
  config.max_depth_m = kMaxDepth_m;
  return config;
}

// range: voxel size [mm], threads
void BM_Integrate(benchmark::State& state) {
  if (frames().empty()) return state.SkipWithError("POCD_TEST_DATA has no redkitchen");
  ThreadPool pool(static_cast<int>(state.range(1)));
  TsdfMap map(config_of(state));
  for (const RealFrame& f : frames()) map.integrate(f.input(), pool);
  std::size_t next = 0;
  for (auto _ : state) map.integrate(frames()[next++ % frames().size()].input(), pool);
  state.counters["blocks"] = static_cast<double>(map.block_count());
}
BENCHMARK(BM_Integrate)
    ->ArgsProduct({{50, 20}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

#ifdef POCD_HAS_OPENCV_RGBD
// One thread each; CPU time per frame in turns. The counters are medians over the frames [ms].
void BM_IntegrateBesideOpenCv(benchmark::State& state) {
  if (frames().empty()) return state.SkipWithError("POCD_TEST_DATA has no redkitchen");
  cv::ocl::setUseOpenCL(false);
  cv::setNumThreads(1);
  ThreadPool pool(1);
  const TsdfConfig config = config_of(state);
  std::vector<double> ours, theirs;
  for (auto _ : state) {
    TsdfMap map(config);
    const cv::Ptr<cv::kinfu::Volume> volume = cv::kinfu::makeVolume(
        cv::kinfu::VolumeType::HASHTSDF, static_cast<float>(config.voxel_size_m),
        cv::Matx44f::eye(), 0.25f, static_cast<float>(config.truncation_m()), config.max_weight,
        static_cast<float>(kMaxDepth_m), cv::Vec3i(16, 16, 16));
    int n = 0;
    for (const RealFrame& f : frames()) {
      cv::Matx44f pose;
      for (int k = 0; k < 16; ++k) {
        pose(k / 4, k % 4) = static_cast<float>(f.frame.T_W_C.matrix()(k / 4, k % 4));
      }
      const double start = cpu_ms();
      map.integrate(f.input(), pool);
      const double between = cpu_ms();
      volume->integrate(f.frame.depth_m, 1.0f, pose, cv::kinfu::Intr(585, 585, 320, 240), n++);
      ours.push_back(between - start);
      theirs.push_back(cpu_ms() - between);
    }
  }
  state.counters["pocd_ms"] = median(ours);
  state.counters["opencv_ms"] = median(theirs);
  state.counters["ratio"] = median(ours) / median(theirs);
}
BENCHMARK(BM_IntegrateBesideOpenCv)->Arg(50)->Arg(20)->Iterations(3)->Unit(benchmark::kMillisecond);
#endif

void BM_PublishAndMesh(benchmark::State& state) {
  if (frames().empty()) return state.SkipWithError("POCD_TEST_DATA has no redkitchen");
  ThreadPool pool(1);
  const TsdfConfig config = config_of(state);
  TsdfMap map(config);
  for (const RealFrame& f : frames()) map.integrate(f.input(), pool);
  std::size_t bytes = 0, triangles = 0, tiles = 0;
  double publish_ms = 0.0;
  for (auto _ : state) {
    for (const BlockKey& key : map.sorted_keys()) map.touch(key);
    MapPublisher publisher(1, config);
    const double start = cpu_ms();
    publisher.update(map);
    publish_ms = cpu_ms() - start;
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
