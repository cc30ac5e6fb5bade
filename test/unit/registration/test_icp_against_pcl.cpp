// Point-to-plane alignment against pcl::IterativeClosestPointWithNormals on the same clouds.
#include <gtest/gtest.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

#include "pocd/registration/point_to_plane_icp.hpp"
#include "test_clouds.hpp"

namespace pocd {
namespace {

pcl::PointCloud<pcl::PointNormal>::Ptr to_pcl(const Points& points, const Points& normals) {
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointNormal>>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    pcl::PointNormal p;
    p.getVector3fMap() = points[i];
    p.getNormalVector3fMap() = normals[i];
    cloud->push_back(p);
  }
  return cloud;
}

// Root mean square distance from the faces of the box to which the points belong.
double true_residual(const Pose& T, const Points& observed, const Pose& truth) {
  double sum = 0.0;
  for (const auto& p : observed) {
    sum += (T * p.cast<double>() - truth * p.cast<double>()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(observed.size()));
}

TEST(PointToPlaneIcp, AsGoodAsPcl) {
  Random random(21);
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d size(1.0, 0.5, 1.2);
    const test::Cloud object = test::box_cloud(random, 2000, {0, 0, 0}, size, 0.004);
    const test::Cloud fresh = test::box_cloud(random, 1500, {0, 0, 0}, size, 0.004);
    const Eigen::Vector3d shift(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0.02);
    const Pose T =
        test::motion_about(0.5 * size, shift, Eigen::Vector3d::UnitZ(), random.uniform(-0.1, 0.1));
    const Points observed = test::transformed(T.inverse(), fresh.points);
    Points observed_normals;
    for (const auto& n : fresh.normals) {
      observed_normals.push_back((T.linear().transpose() * n.cast<double>()).cast<float>());
    }

    pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> peer;
    peer.setInputSource(to_pcl(observed, observed_normals));
    peer.setInputTarget(to_pcl(object.points, object.normals));
    peer.setMaxCorrespondenceDistance(0.4);
    peer.setMaximumIterations(50);
    pcl::PointCloud<pcl::PointNormal> aligned;
    peer.align(aligned);
    const Pose peer_T(peer.getFinalTransformation().cast<double>());

    IcpOptions options;
    options.freedom = IcpFreedom::kFull;
    const IcpTarget target(object.points, object.normals, 0.05, 0.4);
    const IcpResult own = point_to_plane_icp(target, observed, options);
    SCOPED_TRACE(i);
    // 2 mm: half of the noise, the level at which the two samplings differ anyway.
    EXPECT_LT(true_residual(own.T_target_source, observed, T),
              true_residual(peer_T, observed, T) + 0.002);
  }
}

}  // namespace
}  // namespace pocd
