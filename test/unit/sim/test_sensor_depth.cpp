#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "pocd/sim/sensor_model.hpp"

namespace pocd {
namespace {

constexpr int kWidth = 320, kHeight = 240;

cv::Mat flat(float depth_m) { return cv::Mat(kHeight, kWidth, CV_32FC1, cv::Scalar(depth_m)); }

SensorModel only_noise() {
  SensorModel model = SensorModel::perfect();
  model.depth_base_m = 0.002;
  model.depth_quadratic_per_m = 0.0025;
  return model;
}

TEST(SensorDepth, PerfectChangesNothing) {
  cv::Mat depth = flat(2.0f);
  depth.at<float>(5, 5) = 0.0f;
  const cv::Mat before = depth.clone();
  degrade_depth(SensorModel::perfect(), {1, 0, 3}, depth);
  EXPECT_EQ(std::memcmp(before.data, depth.data, depth.total() * 4), 0);
}

TEST(SensorDepth, SigmaGrowsWithTheSquareOfDepth) {
  for (const float z : {0.5f, 2.0f, 4.0f}) {
    const SensorModel model = only_noise();
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (std::uint64_t frame = 0; frame < 640; frame += 16) {  // independent patterns
      cv::Mat depth = flat(z);
      degrade_depth(model, {7, 0, frame}, depth);
      for (int v = 0; v < kHeight; v += 3) {
        for (int u = 0; u < kWidth; u += 3) {
          const double error = depth.at<float>(v, u) - z;
          sum += error, squares += error * error, count += 1.0;
        }
      }
    }
    const double sigma = model.depth_base_m + model.depth_quadratic_per_m * z * z;
    // Half of the variance is common to cells of 24 px: 40 patterns x 140 cells = 5600 independent
    // values, so the measured sigma has a standard error below 1 %; 4 % is four of them.
    EXPECT_NEAR(std::sqrt(squares / count), sigma, 0.04 * sigma) << z;
    EXPECT_NEAR(sum / count, 0.0, 0.05 * sigma) << z;
  }
}

TEST(SensorDepth, NeighboursShareTheConfiguredVariance) {
  for (const double share : {0.0, 0.5}) {
    SensorModel model = only_noise();
    model.correlated_share = share;
    double product = 0.0, squares = 0.0;
    for (std::uint64_t frame = 0; frame < 640; frame += 16) {
      cv::Mat depth = flat(3.0f);
      degrade_depth(model, {9, 0, frame}, depth);
      for (int v = 0; v < kHeight; v += 4) {
        for (int u = 0; u + 1 < kWidth; u += 4) {
          const double a = depth.at<float>(v, u) - 3.0, b = depth.at<float>(v, u + 1) - 3.0;
          product += a * b, squares += a * a;
        }
      }
    }
    // Adjacent pixels see almost the same smooth field (24 px cells): correlation = share, less a
    // few thousandths. Standard error about 1 % as above; 0.04 is four of them.
    EXPECT_NEAR(product / squares, share, 0.04);
  }
}

TEST(SensorDepth, HolesMeetTheirShare) {
  SensorModel model = SensorModel::perfect();
  model.random_hole_share = 0.1;
  int holes = 0;
  for (std::uint64_t frame = 0; frame < 10; ++frame) {
    cv::Mat depth = flat(2.0f);
    degrade_depth(model, {1, 0, frame}, depth);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) holes += depth.at<float>(v, u) == 0.0f;
    }
  }
  // Binomial with n = 768000, p = 0.1: standard error 0.035 %; five of them.
  EXPECT_NEAR(holes / (10.0 * kWidth * kHeight), 0.1, 0.0018);
}

TEST(SensorDepth, EdgesEatTheFarSideOnly) {
  SensorModel model = SensorModel::perfect();
  model.edge_hole_px = 2;
  model.edge_hole_probability = 1.0;
  cv::Mat depth = flat(3.0f);
  depth(cv::Rect(100, 60, 80, 90)).setTo(1.5f);
  degrade_depth(model, {1, 0, 0}, depth);
  EXPECT_EQ(depth.at<float>(100, 97), 3.0f);
  EXPECT_EQ(depth.at<float>(100, 98), 0.0f);
  EXPECT_EQ(depth.at<float>(100, 99), 0.0f);
  EXPECT_EQ(depth.at<float>(100, 100), 1.5f);
  EXPECT_EQ(depth.at<float>(100, 179), 1.5f);
  EXPECT_EQ(depth.at<float>(100, 181), 0.0f);
  EXPECT_EQ(depth.at<float>(100, 182), 3.0f);
  EXPECT_EQ(depth.at<float>(58, 120), 0.0f);
  EXPECT_EQ(depth.at<float>(60, 120), 1.5f);
  EXPECT_EQ(depth.at<float>(151, 120), 0.0f);
}

TEST(SensorDepth, RangeAndQuantum) {
  SensorModel model = SensorModel::perfect();
  model.min_range_m = 0.5, model.max_range_m = 4.0, model.quantum_m = 0.01;
  cv::Mat depth(1, 4, CV_32FC1);
  depth.at<float>(0) = 0.4f, depth.at<float>(1) = 1.2349f, depth.at<float>(2) = 3.999f,
  depth.at<float>(3) = 4.1f;
  degrade_depth(model, {1, 0, 0}, depth);
  EXPECT_EQ(depth.at<float>(0), 0.0f);
  EXPECT_NEAR(depth.at<float>(1), 1.23, 1e-6);  // rounding of a float
  EXPECT_NEAR(depth.at<float>(2), 4.0, 1e-6);
  EXPECT_EQ(depth.at<float>(3), 0.0f);
}

TEST(SensorDepth, DependsOnSeedRobotAndFrameOnly) {
  const auto degraded = [](const NoiseKey& key) {
    cv::Mat depth = flat(2.0f);
    degrade_depth(SensorModel(), key, depth);
    return depth;
  };
  const auto equal = [](const cv::Mat& a, const cv::Mat& b) {
    return std::memcmp(a.data, b.data, a.total() * 4) == 0;
  };
  const cv::Mat first = degraded({1, 0, 5});
  EXPECT_TRUE(equal(first, degraded({1, 0, 5})));
  EXPECT_FALSE(equal(first, degraded({2, 0, 5})));
  EXPECT_FALSE(equal(first, degraded({1, 1, 5})));
  EXPECT_FALSE(equal(first, degraded({1, 0, 6})));
}

}  // namespace
}  // namespace pocd
