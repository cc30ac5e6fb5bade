#include <algorithm>
#include <cmath>
#include <vector>

#include "hash_noise.hpp"
#include "pocd/common/check.hpp"
#include "pocd/sim/sensor_model.hpp"
#include "sensor_edges.hpp"

namespace pocd {
namespace {

enum Channel : std::uint64_t { kGrid = 11, kPixel = 12, kHole = 13, kBlob = 14, kEdge = 15 };
/// Frames between two independent patterns of the correlated noise.
constexpr int kPatternFrames = 8;

/// Noise of unit variance that is smooth over a grid of cells and over frames. Interpolation of
/// independent knots with weights w has variance sum w^2; dividing by its root keeps the variance
/// the same everywhere.
class SmoothField {
 public:
  SmoothField(const NoiseKey& key, int width, int height, double cell_px)
      : cell_px_(cell_px),
        columns_(static_cast<int>(std::ceil(width / cell_px)) + 2),
        rows_(static_cast<int>(std::ceil(height / cell_px)) + 2),
        knots_(static_cast<std::size_t>(columns_) * rows_) {
    const std::uint64_t pattern = key.frame / kPatternFrames;
    const float t = static_cast<float>(key.frame % kPatternFrames) / kPatternFrames;
    const float scale = 1.0f / std::sqrt((1 - t) * (1 - t) + t * t);
    const std::uint64_t seed = hash_of(key.seed, kGrid, key.robot);
    for (std::size_t i = 0; i < knots_.size(); ++i) {
      knots_[i] = scale * ((1 - t) * normal_of(hash_of(seed, pattern, i)) +
                           t * normal_of(hash_of(seed, pattern + 1, i)));
    }
  }

  void row(int v, int width, std::vector<float>& out) const {
    out.resize(static_cast<std::size_t>(width));
    const double y = v / cell_px_;
    const int r = static_cast<int>(y);
    const float b = static_cast<float>(y - r);
    const float* low = &knots_[static_cast<std::size_t>(r) * columns_];
    const float* high = low + columns_;
    const float row_variance = (1 - b) * (1 - b) + b * b;
    for (int u = 0; u < width; ++u) {
      const double x = u / cell_px_;
      const int c = static_cast<int>(x);
      const float a = static_cast<float>(x - c);
      const float value =
          (1 - b) * ((1 - a) * low[c] + a * low[c + 1]) + b * ((1 - a) * high[c] + a * high[c + 1]);
      out[u] = value / std::sqrt(row_variance * ((1 - a) * (1 - a) + a * a));
    }
  }

 private:
  double cell_px_;
  int columns_, rows_;
  std::vector<float> knots_;
};

/// floor(mean) or one more, so that the mean is met.
int draw_count(double mean, Random& random) {
  return static_cast<int>(std::floor(mean + random.uniform()));
}

void punch_holes(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m) {
  Random random(hash_of(key.seed, kHole, key.robot, key.frame));
  const double pixels = static_cast<double>(depth_m.total());
  // Draws with repetition hit a share 1 - exp(-n / pixels) of the pixels.
  const double share = std::min(model.random_hole_share, 1.0 - 1e-6);
  const int singles = draw_count(-std::log1p(-share) * pixels, random);
  for (int i = 0; i < singles; ++i) {
    depth_m.ptr<float>()[random.below(static_cast<std::uint64_t>(depth_m.total()))] = 0.0f;
  }
  Random blob(hash_of(key.seed, kBlob, key.robot, key.frame));
  const int blobs =
      model.hole_blobs_per_frame > 0.0 ? draw_count(model.hole_blobs_per_frame, blob) : 0;
  for (int i = 0; i < blobs; ++i) {
    const int cu = static_cast<int>(blob.below(static_cast<std::uint64_t>(depth_m.cols)));
    const int cv = static_cast<int>(blob.below(static_cast<std::uint64_t>(depth_m.rows)));
    const int radius = 3 + static_cast<int>(blob.below(10));
    for (int v = std::max(0, cv - radius); v <= std::min(depth_m.rows - 1, cv + radius); ++v) {
      for (int u = std::max(0, cu - radius); u <= std::min(depth_m.cols - 1, cu + radius); ++u) {
        const int du = u - cu, dv = v - cv;
        if (du * du + dv * dv <= radius * radius) depth_m.at<float>(v, u) = 0.0f;
      }
    }
  }
}

}  // namespace

SensorModel SensorModel::perfect() {
  SensorModel model;
  model.depth_base_m = model.depth_quadratic_per_m = 0.0;
  model.random_hole_share = model.hole_blobs_per_frame = 0.0;
  model.edge_hole_px = model.edge_hole_probability = 0.0;
  model.quantum_m = 0.0;
  model.min_range_m = 0.0;
  model.max_range_m = 1000.0;
  model.label_border_px = model.label_blobs_per_frame = model.alias_share = 0.0;
  model.position_error_m = model.rotation_error_deg = 0.0;
  model.color_noise = 0.0;
  return model;
}

void degrade_depth(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m) {
  POCD_CHECK(depth_m.type() == CV_32FC1 && depth_m.isContinuous());
  if (model.fattening_px > 0.0) fatten_edges(model, key, depth_m);
  if (model.flying_px > 0.0 && model.flying_share > 0.0) add_flying_pixels(model, key, depth_m);
  if (model.range_hole_share > 0.0) punch_range_holes(model, key, depth_m);
  const bool noisy = model.depth_base_m > 0.0 || model.depth_quadratic_per_m > 0.0;
  const int reach = static_cast<int>(std::lround(model.edge_hole_px));
  const cv::Mat edges = reach > 0 && model.edge_hole_probability > 0.0
                            ? far_side_of_edges(depth_m, reach)
                            : cv::Mat();
  const SmoothField field(key, depth_m.cols, depth_m.rows, model.correlated_cell_px);
  const float own = static_cast<float>(std::sqrt(1.0 - model.correlated_share));
  const float common = static_cast<float>(std::sqrt(model.correlated_share));
  const float base = static_cast<float>(model.depth_base_m);
  const float quadratic = static_cast<float>(model.depth_quadratic_per_m);
  const float low = static_cast<float>(model.min_range_m);
  const float high = static_cast<float>(model.max_range_m);
  const float quantum = static_cast<float>(model.quantum_m);
  std::vector<float> smooth;
  for (int v = 0; v < depth_m.rows; ++v) {
    float* z = depth_m.ptr<float>(v);
    if (noisy) field.row(v, depth_m.cols, smooth);
    Random pixel(hash_of(key.seed, kPixel, key.robot, key.frame * 65536 + v));
    for (int u = 0; u < depth_m.cols; ++u) {
      if (z[u] <= 0.0f) continue;
      if (z[u] < low || z[u] > high) {
        z[u] = 0.0f;
        continue;
      }
      if (noisy) {
        const float sigma = base + quadratic * z[u] * z[u];
        z[u] += sigma * (own * normal_of(pixel.next()) + common * smooth[u]);
      }
      if (quantum > 0.0f) z[u] = quantum * std::floor(z[u] / quantum + 0.5f);
      if (z[u] < 0.0f) z[u] = 0.0f;
    }
  }
  if (!edges.empty()) {
    Random random(hash_of(key.seed, kEdge, key.robot, key.frame));
    for (int v = 0; v < depth_m.rows; ++v) {
      for (int u = 0; u < depth_m.cols; ++u) {
        if (edges.at<std::uint8_t>(v, u) && random.uniform() < model.edge_hole_probability) {
          depth_m.at<float>(v, u) = 0.0f;
        }
      }
    }
  }
  if (model.random_hole_share > 0.0 || model.hole_blobs_per_frame > 0.0) {
    punch_holes(model, key, depth_m);
  }
}

}  // namespace pocd
