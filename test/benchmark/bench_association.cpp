// Alignment and assignment, with PCL's registration as the peer on the same clouds: a box of
// 1 x 0.5 x 1.2 m, 5 mm noise, seen again 10 cm and 5 degrees away.
#include <benchmark/benchmark.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pocd/association/assignment.hpp"
#include "pocd/association/point_to_plane_icp.hpp"
#include "test_clouds.hpp"

namespace pocd {
namespace {

constexpr double kInlier = 0.05;
constexpr double kReach = 0.4;

struct Scene {
  test::Cloud object;
  Points observed;
  Points observed_normals;
  Pose truth;

  explicit Scene(int count) {
    Random random(1);
    const Eigen::Vector3d size(1.0, 0.5, 1.2);
    object = test::box_cloud(random, count, {0, 0, 0}, size, 0.005);
    const test::Cloud fresh = test::box_cloud(random, count, {0, 0, 0}, size, 0.005);
    truth = test::motion_about(0.5 * size, {0.08, -0.06, 0.0}, Eigen::Vector3d::UnitZ(), 0.087);
    observed = test::transformed(truth.inverse(), fresh.points);
    for (const auto& n : fresh.normals) {
      observed_normals.push_back((truth.linear().transpose() * n.cast<double>()).cast<float>());
    }
  }

  // Root mean square distance of the observed points from where they belong.
  double error_mm(const Pose& T) const {
    double sum = 0.0;
    for (const auto& p : observed) {
      sum += (T * p.cast<double>() - truth * p.cast<double>()).squaredNorm();
    }
    return 1e3 * std::sqrt(sum / static_cast<double>(observed.size()));
  }
};

void BM_Icp(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)));
  IcpOptions options;
  options.freedom = state.range(1) == 4 ? IcpFreedom::kYaw : IcpFreedom::kFull;
  const IcpTarget target(scene.object.points, scene.object.normals, kInlier, kReach);
  IcpResult result;
  for (auto _ : state) result = point_to_plane_icp(target, scene.observed, options);
  state.counters["error_mm"] = scene.error_mm(result.T_target_source);
  state.counters["iterations"] = result.iterations;
}
BENCHMARK(BM_Icp)->ArgsProduct({{1000, 2000, 5000}, {4, 6}})->Unit(benchmark::kMillisecond);

void BM_IcpTargetBuild(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(IcpTarget(scene.object.points, scene.object.normals, kInlier, kReach));
  }
}
BENCHMARK(BM_IcpTargetBuild)->Arg(1000)->Arg(2000)->Arg(5000)->Unit(benchmark::kMillisecond);

using PclCloud = pcl::PointCloud<pcl::PointNormal>;

PclCloud::Ptr to_pcl(const Points& points, const Points& normals) {
  auto cloud = pcl::make_shared<PclCloud>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    pcl::PointNormal p;
    p.getVector3fMap() = points[i];
    p.getNormalVector3fMap() = normals[i];
    cloud->push_back(p);
  }
  return cloud;
}

// To convergence of the same kind (steps below about 0.5 mm), with its kd-tree kept over the runs.
void BM_IcpPclPeer(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)));
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(to_pcl(scene.observed, scene.observed_normals));
  icp.setInputTarget(to_pcl(scene.object.points, scene.object.normals));
  icp.setMaxCorrespondenceDistance(kReach);
  icp.setMaximumIterations(40);
  icp.setTransformationEpsilon(0.0005 * 0.0005);
  PclCloud aligned;
  for (auto _ : state) icp.align(aligned);
  state.counters["error_mm"] = scene.error_mm(Pose(icp.getFinalTransformation().cast<double>()));
}
BENCHMARK(BM_IcpPclPeer)->Arg(1000)->Arg(2000)->Arg(5000)->Unit(benchmark::kMillisecond);

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
