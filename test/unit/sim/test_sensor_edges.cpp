// Errors at the borders of things: they need an image and nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "pocd/sim/sensor_model.hpp"

namespace pocd {
namespace {

constexpr int kWidth = 320, kHeight = 240;
const cv::Rect kThing(100, 60, 80, 90);

/// A thing at 1.5 m before a wall at 3 m; no return at all in the last 20 columns.
cv::Mat scene() {
  cv::Mat depth(kHeight, kWidth, CV_32FC1, cv::Scalar(3.0f));
  depth(kThing).setTo(1.5f);
  depth(cv::Rect(300, 0, 20, kHeight)).setTo(0.0f);
  return depth;
}

cv::Mat masks() {
  cv::Mat labels = cv::Mat::zeros(kHeight, kWidth, CV_16UC1);
  labels(kThing).setTo(7);
  return labels;
}

/// Distance in columns and rows from the thing's rectangle; 0 inside.
int outside(int v, int u) {
  const int du = std::max({kThing.x - u, u - (kThing.x + kThing.width - 1), 0});
  const int dv = std::max({kThing.y - v, v - (kThing.y + kThing.height - 1), 0});
  return std::max(du, dv);
}

TEST(SensorEdges, ThingsGrowAndNothingElseChanges) {
  SensorModel model = SensorModel::perfect();
  model.fattening_px = 3;
  const cv::Mat clean = scene();
  int grown = 0, least = 1 << 30, most = 0;
  for (std::uint64_t frame = 0; frame < 20; ++frame) {
    cv::Mat depth = scene();
    degrade_depth(model, {1, 0, frame}, depth);
    int now = 0;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        if (depth.at<float>(v, u) == clean.at<float>(v, u)) continue;
        ++now;
        // The wall is the near side of where nothing returns.
        if (u >= 300) {
          EXPECT_LT(u, 303);
          EXPECT_EQ(depth.at<float>(v, u), 3.0f);
          continue;
        }
        EXPECT_EQ(depth.at<float>(v, u), 1.5f);
        EXPECT_GE(outside(v, u), 1);
        EXPECT_LE(outside(v, u), 3);
      }
    }
    grown += now, least = std::min(least, now), most = std::max(most, now);
  }
  // 340 pixels around the thing and 240 along the wall's end, grown by 0, 1, 2, 3 pixels in shares
  // of 1/6, 1/3, 1/3, 1/6: 1.5 in the mean, over about 50 cells of 12 px a frame. 1000 cells with a
  // spread of 0.96 px: a standard error of 2 %; 10 % leaves room for the corners.
  EXPECT_NEAR(grown / 20.0, 1.5 * 580, 0.1 * 1.5 * 580);
  EXPECT_NE(least, most);
}

TEST(SensorEdges, FlyingPixelsLieBetweenTheSides) {
  SensorModel model = SensorModel::perfect();
  model.flying_px = 2, model.flying_share = 0.4;
  const cv::Mat clean = scene();
  int flying = 0, near_half = 0;
  for (std::uint64_t frame = 0; frame < 20; ++frame) {
    cv::Mat depth = scene();
    degrade_depth(model, {1, 0, frame}, depth);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const float z = depth.at<float>(v, u);
        if (z == clean.at<float>(v, u)) continue;
        ++flying;
        EXPECT_GT(z, 1.5f);
        EXPECT_LT(z, 3.0f);
        EXPECT_GE(outside(v, u), 1);
        EXPECT_LE(outside(v, u), 2);
        near_half += z < 2.0f;  // half of the difference in disparity
      }
    }
  }
  // Two pixels on each of 340 places, without the corners. Binomial with n = 13600, p = 0.4:
  // standard error 57; four of them.
  EXPECT_NEAR(flying, 0.4 * 20 * 2 * 340, 230);
  // p = 0.5 of those: standard error 37.
  EXPECT_NEAR(near_half, 0.5 * flying, 150);
}

TEST(SensorEdges, HolesGrowWithTheSquareOfTheRange) {
  SensorModel model = SensorModel::perfect();
  model.range_hole_share = 0.8, model.max_range_m = 6.0;
  for (const float z : {1.5f, 3.0f, 6.0f}) {
    int holes = 0;
    for (std::uint64_t frame = 0; frame < 20; ++frame) {
      cv::Mat depth(kHeight, kWidth, CV_32FC1, cv::Scalar(z));
      degrade_depth(model, {1, 0, frame}, depth);
      holes += kHeight * kWidth - cv::countNonZero(depth);
    }
    // 54 x 40 cells a frame: 43200 draws, standard error at most 0.24 %; five of them.
    const double share = 0.8 * z * z / 36.0;
    EXPECT_NEAR(holes / (20.0 * kHeight * kWidth), share, 0.012) << z;
  }
}

TEST(SensorEdges, MasksReachOverTheirBordersAsAWhole) {
  SensorModel model = SensorModel::perfect();
  model.label_bleed_px = 4;
  double sum_px = 0.0, squares = 0.0;
  constexpr int kFrames = 400;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    cv::Mat labels = masks();
    degrade_labels(model, {3, 0, frame}, 1, labels);
    // Along one side in the middle of it: the border is straight and moves as one.
    int left = 0;
    while (labels.at<std::uint16_t>(100, left) != 7) ++left;
    for (const int v : {80, 90, 110, 130}) {
      EXPECT_EQ(labels.at<std::uint16_t>(v, left), 7);
      EXPECT_NE(labels.at<std::uint16_t>(v, left - 1), 7);
    }
    const int grown = kThing.x - left;
    EXPECT_LE(std::abs(grown), 4);
    EXPECT_EQ(labels.at<std::uint16_t>(105, 140), 7);
    EXPECT_EQ(labels.at<std::uint16_t>(20, 20), 0);
    sum_px += grown, squares += grown * grown;
  }
  // Errors of either sign: both labels' growth is uniform in [-2, 2] at 33 knots. The difference has
  // a spread of 1.6 px there, less between: a standard error of about 0.3 px; three of them.
  EXPECT_NEAR(sum_px / kFrames, 0.0, 0.9);
  EXPECT_GT(squares / kFrames, 0.5);
}

TEST(SensorEdges, CoarseMasksHaveStepsOfTheirStride) {
  SensorModel model = SensorModel::perfect();
  model.label_stride_px = 8;
  cv::Mat labels = masks();
  degrade_labels(model, {1, 0, 0}, 1, labels);
  int differ = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::uint16_t label = labels.at<std::uint16_t>(v, u);
      EXPECT_EQ(label, labels.at<std::uint16_t>(v / 8 * 8, u / 8 * 8));
      differ += label != masks().at<std::uint16_t>(v, u);
      if (outside(v, u) > 8) {
        EXPECT_EQ(label, 0);
      }
    }
  }
  EXPECT_GT(differ, 0);
}

TEST(SensorEdges, DependOnSeedRobotAndFrameOnly) {
  SensorModel model = SensorModel::perfect();
  model.fattening_px = 3, model.flying_px = 2, model.flying_share = 0.5;
  model.range_hole_share = 0.3, model.max_range_m = 6.0, model.label_bleed_px = 5;
  const auto depth_of = [&](const NoiseKey& key) {
    cv::Mat depth = scene();
    degrade_depth(model, key, depth);
    return depth;
  };
  const auto equal = [](const cv::Mat& a, const cv::Mat& b) {
    return std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
  };
  const cv::Mat first = depth_of({1, 0, 5});
  EXPECT_TRUE(equal(first, depth_of({1, 0, 5})));
  EXPECT_FALSE(equal(first, depth_of({2, 0, 5})));
  EXPECT_FALSE(equal(first, depth_of({1, 1, 5})));
  EXPECT_FALSE(equal(first, depth_of({1, 0, 6})));
}

}  // namespace
}  // namespace pocd
