#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <sstream>
#include <vector>

#include "hash_noise.hpp"
#include "pocd/common/check.hpp"
#include "pocd/sim/sensor_model.hpp"
#include "sensor_edges.hpp"

namespace pocd {
namespace {

enum Channel : std::uint64_t { kBorder = 21, kBlob = 22, kAlias = 23, kPose = 24, kColor = 25 };

/// std::lround without its call.
int nearest(float x) { return static_cast<int>(x + std::copysign(0.5f, x)); }

/// Looks every pixel up at a place displaced by a smooth field: borders become ragged, insides
/// stay.
void ragged_borders(const SensorModel& model, const NoiseKey& key, cv::Mat& labels) {
  constexpr int kCell_px = 5;  // a few pixels, so that borders look torn and not merely shifted
  const int columns = labels.cols / kCell_px + 2, rows = labels.rows / kCell_px + 2;
  const std::uint64_t seed = hash_of(key.seed, kBorder, key.robot, key.frame);
  std::vector<cv::Vec2f> knots(static_cast<std::size_t>(columns) * rows);
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const std::uint64_t hash = hash_of(seed, i);
    const double amplitude = model.label_border_px;
    knots[i] = cv::Vec2f(
        static_cast<float>(amplitude *
                           (2.0 * static_cast<double>(hash & 0xFFFFFFFF) / 4294967296.0 - 1.0)),
        static_cast<float>(amplitude *
                           (2.0 * static_cast<double>(hash >> 32) / 4294967296.0 - 1.0)));
  }
  const cv::Mat clean = labels.clone();
  for (int v = 0; v < labels.rows; ++v) {
    const int r = v / kCell_px;
    const float b = static_cast<float>(v % kCell_px) / kCell_px;
    std::uint16_t* out = labels.ptr<std::uint16_t>(v);
    for (int u = 0; u < labels.cols; ++u) {
      const cv::Vec2f* low = &knots[static_cast<std::size_t>(r) * columns + u / kCell_px];
      const cv::Vec2f* high = low + columns;
      const float a = static_cast<float>(u % kCell_px) / kCell_px;
      const cv::Vec2f shift =
          (1 - b) * ((1 - a) * low[0] + a * low[1]) + b * ((1 - a) * high[0] + a * high[1]);
      const int from_u = std::clamp(u + nearest(shift[0]), 0, labels.cols - 1);
      const int from_v = std::clamp(v + nearest(shift[1]), 0, labels.rows - 1);
      out[u] = clean.at<std::uint16_t>(from_v, from_u);
    }
  }
}

void wrong_blobs(const SensorModel& model, const NoiseKey& key, int label_divisor,
                 cv::Mat& labels) {
  const std::vector<int> classes = model.blob_classes();
  Random random(hash_of(key.seed, kBlob, key.robot, key.frame));
  const int count = static_cast<int>(std::floor(model.label_blobs_per_frame + random.uniform()));
  for (int i = 0; i < count; ++i) {
    const int cu = static_cast<int>(random.below(static_cast<std::uint64_t>(labels.cols)));
    const int cv = static_cast<int>(random.below(static_cast<std::uint64_t>(labels.rows)));
    const int radius =
        static_cast<int>(std::lround(model.label_blob_radius_px * random.uniform(0.3, 1.0)));
    const int wrong = classes[random.below(classes.size())] * label_divisor;
    for (int v = std::max(0, cv - radius); v <= std::min(labels.rows - 1, cv + radius); ++v) {
      for (int u = std::max(0, cu - radius); u <= std::min(labels.cols - 1, cu + radius); ++u) {
        const int du = u - cu, dv = v - cv;
        if (du * du + dv * dv <= radius * radius) {
          labels.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(wrong);
        }
      }
    }
  }
}

}  // namespace

std::vector<int> SensorModel::blob_classes() const {
  std::vector<int> classes;
  std::istringstream text(label_blob_classes);
  for (std::string word; std::getline(text, word, ',');) {
    std::size_t used = 0;
    int value = -1;
    try {
      value = std::stoi(word, &used);
    } catch (const std::exception&) {
    }
    if (value < 0 || value > 65535 || word.find_first_not_of(' ', used) != std::string::npos) {
      throw InputError("label_blob_classes: '" + word + "' is no class");
    }
    classes.push_back(value);
  }
  if (classes.empty()) throw InputError("label_blob_classes: lists no class");
  return classes;
}

void degrade_labels(const SensorModel& model, const NoiseKey& key, int label_divisor,
                    cv::Mat& labels) {
  POCD_CHECK(labels.type() == CV_16UC1 && label_divisor >= 1);
  const std::uint64_t episode = key.frame / static_cast<std::uint64_t>(model.alias_episode_frames);
  if (unit_of(hash_of(key.seed, kAlias, key.robot, episode)) < model.alias_share) {
    for (int v = 0; v < labels.rows; ++v) {
      std::uint16_t* row = labels.ptr<std::uint16_t>(v);
      for (int u = 0; u < labels.cols; ++u) {
        if (row[u] / label_divisor != model.alias_class_a) continue;
        row[u] = static_cast<std::uint16_t>(model.alias_class_b * label_divisor +
                                            row[u] % label_divisor);
      }
    }
  }
  if (model.label_blobs_per_frame > 0.0) wrong_blobs(model, key, label_divisor, labels);
  if (model.label_stride_px > 1) coarsen_masks(model, labels);
  if (model.label_bleed_px > 0.0) bleed_masks(model, key, labels);
  if (model.label_border_px > 0.0) ragged_borders(model, key, labels);
}

void degrade_color(const SensorModel& model, const NoiseKey& key, cv::Mat& color) {
  POCD_CHECK(color.type() == CV_8UC3);
  if (model.color_noise <= 0.0) return;
  const float sigma = static_cast<float>(model.color_noise);
  for (int v = 0; v < color.rows; ++v) {
    Random random(hash_of(key.seed, kColor, key.robot, key.frame * 65536 + v));
    cv::Vec3b* row = color.ptr<cv::Vec3b>(v);
    for (int u = 0; u < color.cols; ++u) {
      const int shift = static_cast<int>(std::lround(sigma * normal_of(random.next())));
      for (int k = 0; k < 3; ++k) row[u][k] = cv::saturate_cast<std::uint8_t>(row[u][k] + shift);
    }
  }
}

Pose degrade_pose(const SensorModel& model, const NoiseKey& key, double time_s, const Pose& T_W_C) {
  const std::uint64_t seed = hash_of(key.seed, kPose, key.robot);
  const double x = time_s / model.pose_error_period_s;
  const auto noise = [&](std::uint64_t channel) { return smooth_noise(seed, channel, x); };
  const double radians = model.rotation_error_deg * M_PI / 180.0;
  Pose out = T_W_C;
  out.translation() += model.position_error_m * Eigen::Vector3d(noise(0), noise(1), noise(2) / 3.0);
  const Eigen::Matrix3d error =
      (Eigen::AngleAxisd(radians * noise(3), Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(radians * noise(4) / 3.0, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(radians * noise(5) / 3.0, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  out.linear() = error * T_W_C.linear();
  return out;
}

}  // namespace pocd
