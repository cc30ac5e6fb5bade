#include "sensor_edges.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "hash_noise.hpp"

namespace pocd {
namespace {

enum Channel : std::uint64_t { kFatten = 31, kFlying = 32, kRangeHole = 33, kBleed = 34 };
/// Along an edge, fattening changes within about this many pixels.
constexpr int kFattenCell_px = 12;
constexpr int kRangeHoleCell_px = 6;
/// Frames in which the growth of a mask changes to an independent one.
constexpr double kBleedPeriod_frames = 12.0;

/// Nearest depth > 0 within `reach` of a pixel in a round window; 0 for none.
float nearest_around(const cv::Mat& depth_m, int v, int u, int reach) {
  float nearest_m = 0.0f;
  for (int y = std::max(0, v - reach); y <= std::min(depth_m.rows - 1, v + reach); ++y) {
    const float* row = depth_m.ptr<float>(y);
    for (int x = std::max(0, u - reach); x <= std::min(depth_m.cols - 1, u + reach); ++x) {
      if ((x - u) * (x - u) + (y - v) * (y - v) > reach * reach || row[x] <= 0.0f) continue;
      if (nearest_m == 0.0f || row[x] < nearest_m) nearest_m = row[x];
    }
  }
  return nearest_m;
}

}  // namespace

cv::Mat far_side_of_edges(const cv::Mat& depth_m, int reach) {
  cv::Mat marked = cv::Mat::zeros(depth_m.size(), CV_8UC1);
  const auto far_of = [](float z, float neighbour) {
    return neighbour > 0.0f && (z == 0.0f || z - neighbour > 0.05f + 0.03f * neighbour);
  };
  for (int v = 0; v < depth_m.rows; ++v) {
    const float* z = depth_m.ptr<float>(v);
    const float* below = v + 1 < depth_m.rows ? depth_m.ptr<float>(v + 1) : nullptr;
    for (int u = 0; u < depth_m.cols; ++u) {
      if (u + 1 < depth_m.cols) {
        if (far_of(z[u], z[u + 1])) {
          for (int k = 0; k < reach && u - k >= 0; ++k) marked.at<std::uint8_t>(v, u - k) = 1;
        } else if (far_of(z[u + 1], z[u])) {
          for (int k = 1; k <= reach && u + k < depth_m.cols; ++k) {
            marked.at<std::uint8_t>(v, u + k) = 1;
          }
        }
      }
      if (below == nullptr) continue;
      if (far_of(z[u], below[u])) {
        for (int k = 0; k < reach && v - k >= 0; ++k) marked.at<std::uint8_t>(v - k, u) = 1;
      } else if (far_of(below[u], z[u])) {
        for (int k = 1; k <= reach && v + k < depth_m.rows; ++k) {
          marked.at<std::uint8_t>(v + k, u) = 1;
        }
      }
    }
  }
  return marked;
}

void fatten_edges(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m) {
  const int reach = static_cast<int>(std::ceil(model.fattening_px));
  const cv::Mat marked = far_side_of_edges(depth_m, reach);
  const cv::Mat clean = depth_m.clone();
  const std::uint64_t seed = hash_of(key.seed, kFatten, key.robot, key.frame);
  for (int v = 0; v < depth_m.rows; ++v) {
    for (int u = 0; u < depth_m.cols; ++u) {
      if (marked.at<std::uint8_t>(v, u) == 0) continue;
      const std::uint64_t cell = hash_of(seed, static_cast<std::uint64_t>(v / kFattenCell_px),
                                         static_cast<std::uint64_t>(u / kFattenCell_px));
      const int grown = static_cast<int>(std::lround(model.fattening_px * unit_of(cell)));
      if (grown == 0) continue;
      const float near_m = nearest_around(clean, v, u, grown);
      if (near_m > 0.0f) depth_m.at<float>(v, u) = near_m;
    }
  }
}

void add_flying_pixels(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m) {
  const int reach = static_cast<int>(std::lround(model.flying_px));
  if (reach == 0) return;
  const cv::Mat marked = far_side_of_edges(depth_m, reach);
  const cv::Mat clean = depth_m.clone();
  Random random(hash_of(key.seed, kFlying, key.robot, key.frame));
  for (int v = 0; v < depth_m.rows; ++v) {
    for (int u = 0; u < depth_m.cols; ++u) {
      if (marked.at<std::uint8_t>(v, u) == 0) continue;
      const bool flies = random.uniform() < model.flying_share;
      const float weight = static_cast<float>(random.uniform());
      const float far_m = clean.at<float>(v, u);
      if (!flies || far_m <= 0.0f) continue;
      const float near_m = nearest_around(clean, v, u, reach);
      depth_m.at<float>(v, u) = 1.0f / (weight / near_m + (1.0f - weight) / far_m);
    }
  }
}

void punch_range_holes(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m) {
  const std::uint64_t seed = hash_of(key.seed, kRangeHole, key.robot, key.frame);
  const double scale = model.range_hole_share / (model.max_range_m * model.max_range_m);
  for (int v = 0; v < depth_m.rows; ++v) {
    float* z = depth_m.ptr<float>(v);
    for (int u = 0; u < depth_m.cols; u += kRangeHoleCell_px) {
      const double drawn =
          unit_of(hash_of(seed, static_cast<std::uint64_t>(v / kRangeHoleCell_px),
                          static_cast<std::uint64_t>(u / kRangeHoleCell_px)));
      for (int x = u; x < std::min(u + kRangeHoleCell_px, depth_m.cols); ++x) {
        if (drawn < scale * z[x] * z[x]) z[x] = 0.0f;
      }
    }
  }
}

void coarsen_masks(const SensorModel& model, cv::Mat& labels) {
  const int stride = model.label_stride_px;
  const cv::Mat clean = labels.clone();
  for (int v = 0; v < labels.rows; ++v) {
    const std::uint16_t* from =
        clean.ptr<std::uint16_t>(std::min(v / stride * stride + stride / 2, labels.rows - 1));
    std::uint16_t* to = labels.ptr<std::uint16_t>(v);
    for (int u = 0; u < labels.cols; ++u) {
      to[u] = from[std::min(u / stride * stride + stride / 2, labels.cols - 1)];
    }
  }
}

void bleed_masks(const SensorModel& model, const NoiseKey& key, cv::Mat& labels) {
  const std::uint64_t seed = hash_of(key.seed, kBleed, key.robot);
  const double time = static_cast<double>(key.frame) / kBleedPeriod_frames;
  std::unordered_map<std::uint16_t, double> growth_px;  // in [-bleed / 2, bleed / 2]
  const auto growth_of = [&](std::uint16_t label) {
    const auto [place, fresh] = growth_px.try_emplace(label, 0.0);
    if (fresh) place->second = 0.5 * model.label_bleed_px * smooth_noise(seed, label, time);
    return place->second;
  };
  // Of two labels, the one that grows more is ahead by the difference: at most label_bleed_px.
  const int reach = static_cast<int>(std::ceil(model.label_bleed_px));
  const cv::Mat clean = labels.clone();
  cv::Mat border = cv::Mat::zeros(labels.size(), CV_8UC1);
  for (int v = 0; v < labels.rows; ++v) {
    for (int u = 0; u < labels.cols; ++u) {
      const std::uint16_t own = clean.at<std::uint16_t>(v, u);
      const bool edge = (u + 1 < labels.cols && clean.at<std::uint16_t>(v, u + 1) != own) ||
                        (v + 1 < labels.rows && clean.at<std::uint16_t>(v + 1, u) != own);
      if (!edge) continue;
      const cv::Rect around(u - reach, v - reach, 2 * reach + 2, 2 * reach + 2);
      border(around & cv::Rect(0, 0, labels.cols, labels.rows)).setTo(1);
    }
  }
  for (int v = 0; v < labels.rows; ++v) {
    for (int u = 0; u < labels.cols; ++u) {
      if (border.at<std::uint8_t>(v, u) == 0) continue;
      std::uint16_t best = clean.at<std::uint16_t>(v, u);
      double best_score = growth_of(best);
      for (int y = std::max(0, v - reach); y <= std::min(labels.rows - 1, v + reach); ++y) {
        for (int x = std::max(0, u - reach); x <= std::min(labels.cols - 1, u + reach); ++x) {
          const std::uint16_t other = clean.at<std::uint16_t>(y, x);
          if (other == clean.at<std::uint16_t>(v, u)) continue;
          const double score = growth_of(other) - std::hypot(x - u, y - v);
          if (score <= best_score) continue;
          best = other, best_score = score;
        }
      }
      labels.at<std::uint16_t>(v, u) = best;
    }
  }
}

}  // namespace pocd
