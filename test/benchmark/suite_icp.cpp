#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

#include "icp_scene.hpp"
#include "report.hpp"
#include "statistics.hpp"
#include "suites.hpp"

namespace pocd::bench {
namespace {

using PclCloud = pcl::PointCloud<pcl::PointNormal>;
constexpr std::size_t kScenes = 15;

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

struct Run {
  Series ours, pcl, ours_build, pcl_build;
  std::vector<double> ours_mm, pcl_mm;
};

void align_both(const IcpScene& scene, std::size_t i, Run& run) {
  const auto ours = [&] {
    std::optional<IcpTarget> target;
    time_into(run.ours_build, i, [&] {
      target.emplace(scene.object.points, scene.object.normals, kInlier_m, kReach_m);
    });
    IcpResult result;
    time_into(run.ours, i, [&] { result = point_to_plane_icp(*target, scene.observed, {}); });
    run.ours_mm.push_back(scene.error_mm(result.T_target_source));
  };
  const auto pcl = [&] {
    const auto source = to_pcl(scene.observed, scene.observed_normals);
    const auto target = to_pcl(scene.object.points, scene.object.normals);
    // To convergence of the same kind: steps below about 0.5 mm.
    pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
    icp.setInputSource(source);
    icp.setInputTarget(target);
    icp.setMaxCorrespondenceDistance(kReach_m);
    icp.setMaximumIterations(40);
    icp.setTransformationEpsilon(0.0005 * 0.0005);
    time_into(run.pcl_build, i, [&] {
      icp.getSearchMethodTarget()->setInputCloud(target);
      icp.setSearchMethodTarget(icp.getSearchMethodTarget(), true);
    });
    PclCloud aligned;
    time_into(run.pcl, i, [&] { icp.align(aligned); });
    run.pcl_mm.push_back(scene.error_mm(Pose(icp.getFinalTransformation().cast<double>())));
  };
  if (i % 2 == 0) {
    ours();
    pcl();
  } else {
    pcl();
    ours();
  }
}

}  // namespace

void run_icp(const SuiteOptions& options, std::ostream& out) {
  Table table(
      "Object ICP, CPU of one thread, medians over " + std::to_string(kScenes) + " scenes",
      {"points", "ours [ms]", "PCL with normals [ms]", "PCL / ours", "target prepared, ours [ms]",
       "kd-tree, PCL [ms]", "both: PCL / ours", "error, ours [mm]", "error, PCL [mm]"});
  for (const int count : {1000, 2000, 5000}) {
    Run run;
    for (int pass = 0; pass < options.passes; ++pass) {
      for (std::size_t i = 0; i < kScenes; ++i) align_both(IcpScene(count, i + 1), i, run);
    }
    const double ours = median(run.ours.cpu()), pcl = median(run.pcl.cpu());
    const double build = median(run.ours_build.cpu()), tree = median(run.pcl_build.cpu());
    table.row({std::to_string(count), number(ours, 3), number(pcl), number(pcl / ours, 1),
               number(build, 3), number(tree, 3), number((pcl + tree) / (ours + build), 1),
               number(median(run.ours_mm)), number(median(run.pcl_mm))});
  }
  table.write(out);
}

}  // namespace pocd::bench
