#include "pocd/observe/pose_refinement.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "pocd/common/rounding.hpp"

namespace pocd {
namespace {

using Vector4d = Eigen::Vector4d;
using Matrix4d = Eigen::Matrix4d;

/// Beyond this distance two points are not the same place of a surface [m].
constexpr double kTukeyM = 0.10;
/// Depth errors of neighbouring points are alike: this many tell as much as one [points].
constexpr double kCorrelated = 20.0;
/// Objects must be believed in, and points measured often, to be leaned on.
constexpr double kTrusted = 0.6;
constexpr int kTrustedHits = 3;
constexpr int kIterations = 4;

struct Normal {
  Matrix4d H = Matrix4d::Zero();
  Vector4d b = Vector4d::Zero();
  int pairs = 0;
  int agree = 0;
};

Pose motion(const Vector4d& x, const Eigen::Vector3d& eye_W) {
  // Heading turns about the camera, so that turning and shifting stay apart.
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(x[3], Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = eye_W + x.head<3>() - T.linear() * eye_W;
  return T;
}

class Aligner {
 public:
  Aligner(const OrganizedCloud& cloud, double max_depth_m, const DepthNoise& noise)
      : cloud_(cloud), max_depth_(static_cast<float>(max_depth_m)), noise_(noise) {}

  void add(const LibraryObject& object, const Pose& T_W_W, const Vector4d& x, Normal& sum) const {
    const Eigen::Isometry3f T_C_W = (T_W_W * cloud_.T_W_C).inverse().cast<float>();
    const Eigen::Isometry3f T = T_W_W.cast<float>();
    const Eigen::Vector3d eye_W = cloud_.T_W_C.translation();
    const auto fx = static_cast<float>(cloud_.camera.fx), fy = static_cast<float>(cloud_.camera.fy);
    const auto cx = static_cast<float>(cloud_.camera.cx), cy = static_cast<float>(cloud_.camera.cy);
    for (const Surfel& s : object.model.surfels()) {
      if (s.hits < kTrustedHits || s.seen_through > 0 || s.normal_W.squaredNorm() < 0.5f) continue;
      const Eigen::Vector3f p_C = T_C_W * s.point_W;
      if (p_C.z() < 0.1f || p_C.z() > max_depth_) continue;
      const int col = round_to_int(fx * p_C.x() / p_C.z() + cx);
      const int row = round_to_int(fy * p_C.y() / p_C.z() + cy);
      if (col < 0 || row < 0 || col >= cloud_.width || row >= cloud_.height) continue;
      const std::size_t i = static_cast<std::size_t>(row) * cloud_.width + col;
      if (cloud_.kind[i] != PixelKind::kObject && cloud_.kind[i] != PixelKind::kBackground)
        continue;
      // Rays that graze the surface measure the silhouette, not the surface.
      const Eigen::Vector3f ray = s.point_W - eye_W.cast<float>();
      if (-s.normal_W.dot(ray) < 0.2f * ray.norm()) continue;
      const Eigen::Vector3f raw = cloud_.point_W(i);
      const double r = s.normal_W.dot(T * raw - s.point_W);
      if (std::abs(r) > 2.0 * kTukeyM) continue;
      ++sum.pairs;
      if (std::abs(r) >= kTukeyM) continue;
      ++sum.agree;
      const double sigma = noise_.sigma(p_C.z()) + 0.01;
      const double tukey = 1.0 - (r / kTukeyM) * (r / kTukeyM);
      const double w = tukey * tukey / (sigma * sigma * kCorrelated);
      const Eigen::Vector3d arm = raw.cast<double>() - eye_W;
      const Eigen::Vector3d n = s.normal_W.cast<double>();
      Vector4d J;
      J << n, n.y() * arm.x() - n.x() * arm.y();
      sum.H += w * J * J.transpose();
      sum.b += w * J *
               (r - J.dot(x));  // linearised about zero, so that the prior stays at the given pose
    }
  }

 private:
  const OrganizedCloud& cloud_;
  float max_depth_;
  const DepthNoise& noise_;
};

}  // namespace

std::optional<Pose> refine_pose(const OrganizedCloud& cloud, const ObjectLibrary& library,
                                double max_depth_m, const DepthNoise& noise,
                                const PoseRefinementConfig& config) {
  const Eigen::Vector3d eye_W = cloud.T_W_C.translation();
  const ViewBall view = view_ball(cloud, max_depth_m);
  const auto ids = library.near(view.center_W, view.radius_m);
  const double heading_rad = config.sigma_heading_deg * M_PI / 180.0;
  const Vector4d sigma(config.sigma_position_m, config.sigma_position_m,
                       config.sigma_position_m / 3.0, heading_rad);
  const Matrix4d prior = sigma.cwiseAbs2().cwiseInverse().asDiagonal();

  const Aligner aligner(cloud, max_depth_m, noise);
  Vector4d x = Vector4d::Zero();
  Normal sum;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    sum = Normal{};
    const Pose T = motion(x, eye_W);
    for (const ObjectId id : ids) {
      const LibraryObject& object = *library.find(id);
      if (object.confirmed && object.belief.stationarity() > kTrusted)
        aligner.add(object, T, x, sum);
    }
    if (sum.pairs < config.min_points) return std::nullopt;
    x = -(sum.H + prior).ldlt().solve(sum.b);
  }
  // Most of what is known must agree with the correction; else it is not the pose that is wrong.
  if (2 * sum.agree < sum.pairs) return std::nullopt;
  if (x.head<3>().norm() > config.max_correction_m ||
      std::abs(x[3]) > config.max_correction_deg * M_PI / 180.0) {
    return std::nullopt;
  }
  return motion(x, eye_W);
}

void apply_correction(const Pose& T_W_W, OrganizedCloud& cloud) {
  cloud.T_W_C = T_W_W * cloud.T_W_C;
  const Eigen::Matrix3f R = T_W_W.linear().cast<float>();
  const Eigen::Vector3f t = T_W_W.translation().cast<float>();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f p = R * cloud.point_W(i) + t;
    cloud.x_W[i] = p.x();
    cloud.y_W[i] = p.y();
    cloud.z_W[i] = p.z();
  }
}

}  // namespace pocd
