#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "pocd/common/check.hpp"
#include "pocd/segmentation/observations.hpp"

namespace pocd {
namespace {

double wrap_pi(double angle) { return std::remainder(angle, 2.0 * M_PI); }

/// Extent of the points along a heading, the outermost `trim` share on each side left out.
OrientedBox box_at_heading(const Points& points_W, double yaw, double trim) {
  const double c = std::cos(yaw), s = std::sin(yaw);
  std::array<std::vector<float>, 3> axis;
  for (auto& values : axis) values.reserve(points_W.size());
  for (const Eigen::Vector3f& p : points_W) {
    axis[0].push_back(static_cast<float>(c * p.x() + s * p.y()));
    axis[1].push_back(static_cast<float>(-s * p.x() + c * p.y()));
    axis[2].push_back(p.z());
  }
  Eigen::Vector3d low, high;
  const auto skip = static_cast<std::ptrdiff_t>(trim * static_cast<double>(points_W.size()));
  for (int k = 0; k < 3; ++k) {
    // A heap of the few outermost: most points are one comparison that goes the usual way.
    auto& v = axis[k];
    std::partial_sort(v.begin(), v.begin() + skip + 1, v.end());
    low[k] = v[skip];
    std::partial_sort(v.begin(), v.begin() + skip + 1, v.end(), std::greater<>());
    high[k] = v[skip];
  }
  const Eigen::Vector3d mid = 0.5 * (low + high);
  OrientedBox box;
  box.size_m = (high - low).cwiseMax(0.0);
  box.pose.position_W = {c * mid.x() - s * mid.y(), s * mid.x() + c * mid.y(), mid.z()};
  box.pose.yaw_rad = wrap_pi(yaw);
  return box;
}

std::vector<cv::Point2f> footprint(const OrientedBox& box, double min_size_m) {
  const double c = std::cos(box.pose.yaw_rad), s = std::sin(box.pose.yaw_rad);
  const double hx = 0.5 * std::max(box.size_m.x(), min_size_m);
  const double hy = 0.5 * std::max(box.size_m.y(), min_size_m);
  std::vector<cv::Point2f> corners;
  for (const auto& [x, y] : {std::pair{hx, hy}, {-hx, hy}, {-hx, -hy}, {hx, -hy}}) {
    corners.emplace_back(static_cast<float>(box.pose.position_W.x() + c * x - s * y),
                         static_cast<float>(box.pose.position_W.y() + s * x + c * y));
  }
  return corners;
}

}  // namespace

namespace {

/// Heading in (-45, 45] degrees, modulo a quarter turn, to which upright normals agree; nothing
/// when there are few or they do not agree (round or cluttered things).
std::optional<double> heading_of_normals(const Points& normals_W) {
  constexpr float kUpright = 0.5f;    // sine of the largest tilt of a side face
  constexpr double kAgreement = 0.7;  // mean resultant length of four times the angle
  double c = 0.0, s = 0.0;
  std::size_t count = 0;
  // Points of one plane share its normal, and follow each other.
  Eigen::Vector3f last = Eigen::Vector3f::Zero();
  double last_c = 0.0, last_s = 0.0;
  for (const Eigen::Vector3f& n : normals_W) {
    if (n.squaredNorm() < 0.5f || std::abs(n.z()) > kUpright) continue;
    if (n != last) {
      const double angle = 4.0 * std::atan2(n.y(), n.x());
      last = n, last_c = std::cos(angle), last_s = std::sin(angle);
    }
    c += last_c, s += last_s;
    ++count;
  }
  if (count < 10 || 5 * count < normals_W.size()) return std::nullopt;
  if (std::hypot(c, s) < kAgreement * static_cast<double>(count)) return std::nullopt;
  return std::atan2(s, c) / 4.0;
}

}  // namespace

OrientedBox fit_box(const Points& points_W, const Points& normals_W, double trim) {
  POCD_CHECK(!points_W.empty());
  if (const auto heading = heading_of_normals(normals_W)) {
    OrientedBox box = box_at_heading(points_W, *heading, trim);
    if (box.size_m.x() < box.size_m.y()) {
      std::swap(box.size_m.x(), box.size_m.y());
      box.pose.yaw_rad = wrap_pi(box.pose.yaw_rad + M_PI / 2);
    }
    return box;
  }
  // Relative to the first point, so that float coordinates stay exact far from the origin.
  std::vector<cv::Point2f> flat;
  flat.reserve(points_W.size());
  const Eigen::Vector3f origin = points_W.front();
  for (const auto& p : points_W) flat.emplace_back(p.x() - origin.x(), p.y() - origin.y());
  double yaw = 0.0;
  if (flat.size() >= 3) {
    const cv::RotatedRect rect = cv::minAreaRect(flat);
    yaw = rect.angle * M_PI / 180.0;
    // Heading along the longer side, in (-90, 90] degrees.
    if (rect.size.width < rect.size.height) yaw += M_PI / 2;
    yaw = std::remainder(yaw, M_PI);
  }
  return box_at_heading(points_W, yaw, trim);
}

OrientedBox fit_box_pca(const Points& points_W) {
  POCD_CHECK(!points_W.empty());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points_W) mean += p.head<2>().cast<double>();
  mean /= static_cast<double>(points_W.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const auto& p : points_W) {
    const Eigen::Vector2d d = p.head<2>().cast<double>() - mean;
    covariance += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);
  const Eigen::Vector2d major = solver.eigenvectors().col(1);
  return box_at_heading(points_W, std::remainder(std::atan2(major.y(), major.x()), M_PI), 0.0);
}

double box_overlap(const OrientedBox& a, const OrientedBox& b, double min_size_m) {
  const auto size = [&](const OrientedBox& box) { return box.size_m.cwiseMax(min_size_m).eval(); };
  const Eigen::Vector3d sa = size(a), sb = size(b);
  const double low =
      std::max(a.pose.position_W.z() - sa.z() / 2, b.pose.position_W.z() - sb.z() / 2);
  const double high =
      std::min(a.pose.position_W.z() + sa.z() / 2, b.pose.position_W.z() + sb.z() / 2);
  if (high <= low) return 0.0;
  const double reach = 0.5 * (sa.head<2>().norm() + sb.head<2>().norm());
  if ((a.pose.position_W - b.pose.position_W).head<2>().norm() >= reach) return 0.0;
  std::vector<cv::Point2f> common;
  const float area =
      cv::intersectConvexConvex(footprint(a, min_size_m), footprint(b, min_size_m), common);
  return static_cast<double>(area) * (high - low) / std::min(sa.prod(), sb.prod());
}

}  // namespace pocd
