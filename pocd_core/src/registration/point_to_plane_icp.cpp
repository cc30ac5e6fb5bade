#include "pocd/registration/point_to_plane_icp.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Enough points to get the pose to a few millimetres before all of them are asked.
constexpr std::size_t kCoarsePoints = 400;
// The coarse steps stop at this multiple of the convergence bound.
constexpr double kCoarseConvergence = 6.0;
// The robust scale shrinks by this factor a step from the correspondence distance to its final
// value (graduated non-convexity): a face that is far off must first be let pull.
constexpr double kAnnealing = 0.5;

// Source points about their centroid, and where the centroid is now.
struct Source {
  std::vector<Eigen::Vector3f> points;
  Eigen::Vector3d centroid_W = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  ///< rms lever arm of a rotation
};

struct State {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d centroid;  ///< relative to the target's origin
};

// Gauss-Newton system in N unknowns: translation, then rotation times the lever arm.
template <int N>
struct System {
  Eigen::Matrix<double, N, N> hessian = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> gradient = Eigen::Matrix<double, N, 1>::Zero();
  double weight = 0.0;
};

Source make_source(const Points& points_W, IcpFreedom freedom) {
  Source source;
  for (const auto& p : points_W) source.centroid_W += p.cast<double>();
  source.centroid_W /= static_cast<double>(points_W.size());
  source.points.reserve(points_W.size());
  double sum = 0.0;
  for (const auto& p : points_W) {
    const Eigen::Vector3d lever = p.cast<double>() - source.centroid_W;
    sum += freedom == IcpFreedom::kYaw ? lever.head<2>().squaredNorm() : lever.squaredNorm();
    source.points.push_back(lever.cast<float>());
  }
  // A single point has no lever arm; any positive number serves then.
  source.radius_m = std::max(1e-6, std::sqrt(sum / static_cast<double>(points_W.size())));
  return source;
}

template <int N>
System<N> linearise(const IcpTarget& target, const Source& source, const State& state,
                    std::size_t stride, double robust_scale_m) {
  const Eigen::Matrix3f rotation = state.rotation.cast<float>();
  const Eigen::Vector3f centroid = state.centroid.cast<float>();
  const float per_radius = static_cast<float>(1.0 / source.radius_m);
  const float per_scale2 = static_cast<float>(1.0 / (robust_scale_m * robust_scale_m));
  System<N> system;
  for (std::size_t i = 0; i < source.points.size(); i += stride) {
    const Eigen::Vector3f lever = rotation * source.points[i];
    const Eigen::Vector3f x = centroid + lever;
    const auto match = target.nearest(x);
    if (!match || match->normal.squaredNorm() < 0.5f) continue;
    const Eigen::Vector3f& n = match->normal;
    const float residual = n.dot(x - match->point);
    const double weight = 1.0f / (1.0f + residual * residual * per_scale2);
    Eigen::Matrix<double, N, 1> row;
    row.template head<3>() = n.cast<double>();
    if constexpr (N == 4) {
      row[3] = (lever.x() * n.y() - lever.y() * n.x()) * per_radius;
    } else {
      row.template tail<3>() = (lever.cross(n) * per_radius).template cast<double>();
    }
    const Eigen::Matrix<double, N, 1> weighted = weight * row;
    for (int c = 0; c < N; ++c) {
      for (int r = 0; r <= c; ++r) system.hessian(r, c) += weighted[r] * row[c];
    }
    system.gradient += weighted * static_cast<double>(residual);
    system.weight += weight;
  }
  system.hessian = system.hessian.template selfadjointView<Eigen::Upper>();
  return system;
}

template <int N>
Vector6d to_six(const Eigen::Matrix<double, N, 1>& x) {
  Vector6d six = Vector6d::Zero();
  six.template head<3>() = x.template head<3>();
  six.template tail<N - 3>() = x.template tail<N - 3>();
  if constexpr (N == 4) six << x[0], x[1], x[2], 0.0, 0.0, x[3];
  return six;
}

// Solves in the constrained directions only; the others are appended to `unconstrained`.
template <int N>
Vector6d solve(const System<N>& system, double min_eigenvalue,
               std::vector<Vector6d>& unconstrained) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(system.hessian);
  Eigen::Matrix<double, N, 1> step = Eigen::Matrix<double, N, 1>::Zero();
  unconstrained.clear();
  for (int i = 0; i < N; ++i) {
    const auto direction = eigen.eigenvectors().col(i);
    if (eigen.eigenvalues()[i] < min_eigenvalue * system.weight) {
      unconstrained.push_back(to_six<N>(direction));
    } else {
      step -= direction * (direction.dot(system.gradient) / eigen.eigenvalues()[i]);
    }
  }
  return to_six<N>(step);
}

void apply(const Vector6d& step, double radius_m, State& state) {
  state.centroid += step.head<3>();
  const Eigen::Vector3d rotation = step.tail<3>() / radius_m;
  const double angle = rotation.norm();
  if (angle == 0.0) return;
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix() * state.rotation;
  state.rotation = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
}

template <int N>
void iterate(const IcpTarget& target, const Source& source, const IcpOptions& options, State& state,
             IcpResult& result) {
  std::size_t stride = std::max<std::size_t>(1, source.points.size() / kCoarsePoints);
  double scale_m = std::max(options.robust_scale_m, target.max_correspondence_m());
  while (result.iterations < options.max_iterations) {
    const System<N> system = linearise<N>(target, source, state, stride, scale_m);
    ++result.iterations;
    if (system.weight == 0.0) return;
    const Vector6d step = solve<N>(system, options.min_eigenvalue, result.unconstrained);
    apply(step, source.radius_m, state);
    const bool annealed = scale_m == options.robust_scale_m;
    scale_m = std::max(options.robust_scale_m, kAnnealing * scale_m);
    if (!annealed) continue;
    if (stride > 1) {
      if (step.norm() < kCoarseConvergence * options.convergence_m) stride = 1;
    } else if (step.norm() < options.convergence_m) {
      result.converged = true;
      return;
    }
  }
}

void evaluate(const IcpTarget& target, const Source& source, const State& state,
              IcpResult& result) {
  const Eigen::Matrix3f rotation = state.rotation.cast<float>();
  const Eigen::Vector3f centroid = state.centroid.cast<float>();
  std::size_t inliers = 0;
  double sum = 0.0;
  for (const auto& p : source.points) {
    const Eigen::Vector3f x = centroid + rotation * p;
    const auto match = target.nearest_inlier(x);
    if (!match) continue;
    ++inliers;
    const double residual = match->normal.dot(x - match->point);
    sum += residual * residual;
  }
  const double count = static_cast<double>(source.points.size());
  result.dissimilarity = 1.0 - static_cast<double>(inliers) / count;
  result.rms_residual_m = inliers == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(inliers));
}

}  // namespace

IcpResult point_to_plane_icp(const IcpTarget& target, const Points& source_W,
                             const IcpOptions& options, const Pose& T_initial) {
  POCD_CHECK(options.max_iterations >= 1);
  POCD_CHECK(options.convergence_m > 0.0 && options.robust_scale_m > 0.0);
  POCD_CHECK(options.min_eigenvalue > 0.0);
  IcpResult result;
  result.T_target_source = T_initial;
  if (source_W.empty()) return result;

  const Source source = make_source(source_W, options.freedom);
  State state{T_initial.linear(), T_initial * source.centroid_W - target.origin_W()};
  if (options.freedom == IcpFreedom::kYaw) {
    iterate<4>(target, source, options, state, result);
  } else {
    iterate<6>(target, source, options, state, result);
  }
  result.T_target_source.linear() = state.rotation;
  result.T_target_source.translation() =
      state.centroid + target.origin_W() - state.rotation * source.centroid_W;
  evaluate(target, source, state, result);
  return result;
}

}  // namespace pocd
