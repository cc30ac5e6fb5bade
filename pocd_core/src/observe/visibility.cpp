#include "pocd/observe/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "pocd/common/rounding.hpp"

namespace pocd {

void DepthField::update(const OrganizedCloud& cloud) {
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  cv::Mat depth(cloud.height, cloud.width, CV_32F);
  float* out = depth.ptr<float>();
  for (std::size_t i = 0; i < cloud.size(); ++i)
    out[i] = cloud.depth_m[i] > 0.0f ? cloud.depth_m[i] : kNothing;
  // Each radius erodes the one before it: the widest window costs as little as the difference.
  int done = 0;
  const cv::Mat* source = &depth;
  for (std::size_t k = 0; k < kRadii.size(); ++k) {
    const int side = 2 * (kRadii[k] - done) + 1;
    cv::erode(*source, nearest_[k], cv::getStructuringElement(cv::MORPH_RECT, {side, side}),
              {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(kNothing));
    done = kRadii[k];
    source = &nearest_[k];
  }
}

float DepthField::nearest(int col, int row, float radius_px) const {
  std::size_t k = 0;
  while (k + 1 < kRadii.size() && static_cast<float>(kRadii[k]) < radius_px) ++k;
  return nearest_[k].at<float>(row, col);
}

namespace {

struct Projected {
  int col, row;
  float depth_m;
};

bool is_measurement(PixelKind kind) {
  return kind != PixelKind::kDynamic && kind != PixelKind::kIgnore;
}

/// The measurement among the 3 x 3 pixels around that is nearest to the expected depth, or -1.
std::int32_t best_pixel(const OrganizedCloud& cloud, const Projected& at) {
  std::int32_t best = -1;
  float best_gap = std::numeric_limits<float>::infinity();
  for (int row = std::max(0, at.row - 1); row <= std::min(cloud.height - 1, at.row + 1); ++row) {
    for (int col = std::max(0, at.col - 1); col <= std::min(cloud.width - 1, at.col + 1); ++col) {
      const std::int32_t i = row * cloud.width + col;
      if (cloud.depth_m[i] <= 0.0f) continue;
      const float gap = std::abs(cloud.depth_m[i] - at.depth_m);
      if (gap < best_gap) best_gap = gap, best = i;
    }
  }
  return best;
}

void touch(std::vector<Sighting::Touch>& touches, std::int32_t observation, bool hit) {
  if (observation == Observations::kNone) return;
  for (auto& t : touches) {
    if (t.observation == observation) {
      ++(hit ? t.hit : t.in_front);
      return;
    }
  }
  touches.push_back({observation, hit ? 1 : 0, hit ? 0 : 1});
}

}  // namespace

void sight_object(const std::vector<Surfel>& surfels, int min_hits, const OrganizedCloud& cloud,
                  const DepthField& field, const Observations& observations,
                  const SightConfig& config, const DepthNoise& noise, Sighting& out) {
  out.total = out.hit = out.seen_through = out.occluded = out.unknown = 0;
  out.differences_m.clear();
  out.touches.clear();
  out.sights.assign(surfels.size(), Sight::kOutOfView);
  const Eigen::Isometry3f T_C_W = cloud.T_W_C.inverse().cast<float>();
  const Eigen::Vector3f eye_W = cloud.T_W_C.translation().cast<float>();
  const auto fx = static_cast<float>(cloud.camera.fx), fy = static_cast<float>(cloud.camera.fy);
  const auto cx = static_cast<float>(cloud.camera.cx), cy = static_cast<float>(cloud.camera.cy);
  const auto max_depth = static_cast<float>(config.max_depth_m);
  const auto pose_px = static_cast<float>(config.pose_tolerance_m) * fx;
  constexpr float kMinDepth = 0.1f;

  for (std::size_t k = 0; k < surfels.size(); ++k) {
    const Surfel& surfel = surfels[k];
    if (surfel.hits < min_hits) continue;
    ++out.total;
    const Eigen::Vector3f p_C = T_C_W * surfel.point_W;
    if (p_C.z() < kMinDepth || p_C.z() > max_depth) continue;
    const Projected at{round_to_int(fx * p_C.x() / p_C.z() + cx),
                       round_to_int(fy * p_C.y() / p_C.z() + cy), p_C.z()};
    if (at.col < 0 || at.row < 0 || at.col >= cloud.width || at.row >= cloud.height) continue;
    const Eigen::Vector3f ray = eye_W - surfel.point_W;
    // Less than about six degrees between ray and surface measures nothing of the surface; but what
    // lies behind it is seen only when it is gone.
    const bool turned_away =
        surfel.normal_W.dot(ray) < 0.1f * ray.norm() && surfel.normal_W.squaredNorm() > 0.5f;

    const std::int32_t pixel = best_pixel(cloud, at);
    if (pixel < 0) {
      if (turned_away) continue;
      out.sights[k] = Sight::kUnknown;
      ++out.unknown;
      continue;
    }
    const float margin = std::max(static_cast<float>(config.margin_m),
                                  3.0f * static_cast<float>(noise.sigma(at.depth_m)) +
                                      static_cast<float>(config.pose_tolerance_m));
    const float difference = cloud.depth_m[pixel] - at.depth_m;
    Sight sight = Sight::kUnknown;
    if (!is_measurement(cloud.kind[pixel])) {
      sight = Sight::kOccluded;
    } else if (std::abs(difference) <= margin) {
      sight = Sight::kHit;
    } else if (difference < 0.0f) {
      sight = Sight::kOccluded;
    } else if (field.nearest(at.col, at.row, pose_px / at.depth_m) > at.depth_m + margin) {
      sight = Sight::kSeenThrough;
    }
    if (turned_away && sight != Sight::kSeenThrough) continue;
    out.sights[k] = sight;
    switch (sight) {
      case Sight::kHit:
        ++out.hit;
        out.differences_m.push_back(difference);
        touch(out.touches, observations.observation_of[pixel], true);
        break;
      case Sight::kSeenThrough:
        ++out.seen_through;
        out.differences_m.push_back(difference);
        break;
      case Sight::kOccluded:
        ++out.occluded;
        if (difference > -static_cast<float>(config.cover_m))
          touch(out.touches, observations.observation_of[pixel], false);
        break;
      case Sight::kUnknown:
        ++out.unknown;
        break;
      case Sight::kOutOfView:
        break;
    }
  }
  std::sort(out.touches.begin(), out.touches.end(),
            [](const auto& a, const auto& b) { return a.observation < b.observation; });
}

}  // namespace pocd
