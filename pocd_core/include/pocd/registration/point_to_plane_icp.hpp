// Point-to-plane alignment of an observation with an object (Chen and Medioni, 1992), which slides
// along no direction that the surface leaves open.
#pragma once

#include <vector>

#include "pocd/registration/icp_target.hpp"

namespace pocd {

/// Directions in which an alignment may move.
enum class IcpFreedom {
  kYaw,   ///< x, y, z and rotation about the world's z axis: what an object on the floor can do
  kFull,  ///< all six
};

struct IcpOptions {
  IcpFreedom freedom = IcpFreedom::kYaw;
  int max_iterations = 30;       ///< >= 1
  double convergence_m = 5e-4;   ///< stop when a step moves the points by less (rms)
  double robust_scale_m = 0.05;  ///< Cauchy weight 1 / (1 + (residual / scale)^2)
  /// Smallest eigenvalue, relative to the weight of all points, of a direction that counts as
  /// constrained: the mean squared cosine between normals and motion. 0.02 is a rms tilt of 8
  /// degrees, which noisy normals of a plane stay below.
  double min_eigenvalue = 0.02;
};

using Vector6d = Eigen::Matrix<double, 6, 1>;

struct IcpResult {
  /// Takes source points to where they lie on the target; both in the world frame.
  Pose T_target_source = Pose::Identity();
  bool converged = false;
  int iterations = 0;
  /// Share of source points whose nearest target point is farther than the target's inlier
  /// distance.
  double dissimilarity = 1.0;
  /// Root mean square of the inliers' distances from the tangent planes [m].
  double rms_residual_m = 0.0;
  /// Unit directions without constraint at the end, in which no motion was made: (x, y, z, rx, ry,
  /// rz), rotations about the source's centroid and scaled so that 1 moves the points by 1 m (rms).
  std::vector<Vector6d> unconstrained;
};

/// Aligns `source_W` (no normals needed) with the target, starting from `T_initial`. An empty
/// source, or none within the correspondence distance: not converged, T_initial, dissimilarity 1.
/// The same input gives the same bits; cost O(source points x iterations).
///
/// Degenerate directions are projected out of every step (solution remapping; Zhang, Kaess and
/// Singh, ICRA 2016). The first steps use a regular subset of the points, the last ones all of
/// them.
IcpResult point_to_plane_icp(const IcpTarget& target, const Points& source_W,
                             const IcpOptions& options, const Pose& T_initial = Pose::Identity());

}  // namespace pocd
