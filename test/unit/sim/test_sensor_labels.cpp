#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "pocd/sim/sensor_model.hpp"

namespace pocd {
namespace {

cv::Mat two_halves() {
  cv::Mat labels(120, 160, CV_16UC1, cv::Scalar(7));
  labels(cv::Rect(80, 0, 80, 120)).setTo(4);
  return labels;
}

int differing(const cv::Mat& a, const cv::Mat& b) { return cv::countNonZero(a != b); }

TEST(SensorLabels, PerfectChangesNothing) {
  cv::Mat labels = two_halves();
  degrade_labels(SensorModel::perfect(), {1, 0, 0}, 1, labels);
  EXPECT_EQ(differing(labels, two_halves()), 0);
}

TEST(SensorLabels, RaggednessStaysAtTheBorder) {
  SensorModel model = SensorModel::perfect();
  model.label_border_px = 3.0;
  cv::Mat labels = two_halves();
  degrade_labels(model, {1, 0, 0}, 1, labels);
  const cv::Mat clean = two_halves();
  EXPECT_GT(differing(labels, clean), 50);
  // Pixels move by at most 3, so columns farther from the border than that keep their class.
  EXPECT_EQ(differing(labels.colRange(0, 77), clean.colRange(0, 77)), 0);
  EXPECT_EQ(differing(labels.colRange(83, 160), clean.colRange(83, 160)), 0);
}

TEST(SensorLabels, AliasingIsWholeFramesInEpisodes) {
  SensorModel model = SensorModel::perfect();
  model.alias_share = 0.3;
  model.alias_episode_frames = 8;
  int aliased = 0;
  constexpr int kFrames = 8000;
  bool previous = false;
  for (int frame = 0; frame < kFrames; ++frame) {
    cv::Mat labels(4, 4, CV_16UC1, cv::Scalar(4 * 100 + 3));
    labels.at<std::uint16_t>(0, 0) = 7 * 100 + 1;
    degrade_labels(model, {3, 0, static_cast<std::uint64_t>(frame)}, 100, labels);
    EXPECT_EQ(labels.at<std::uint16_t>(0, 0), 701);
    const bool now = labels.at<std::uint16_t>(3, 3) == 503;
    ASSERT_EQ(cv::countNonZero(labels == (now ? 503 : 403)), 15);
    if (frame % 8 != 0) {
      ASSERT_EQ(now, previous) << frame;
    }
    previous = now;
    aliased += now;
  }
  // 1000 independent episodes with p = 0.3: standard error 1.45 %; four of them.
  EXPECT_NEAR(aliased / static_cast<double>(kFrames), 0.3, 0.058);
}

TEST(SensorLabels, BlobsAreRoundAndFew) {
  SensorModel model = SensorModel::perfect();
  model.label_blobs_per_frame = 2.0;
  model.label_blob_radius_px = 6.0;
  int wrong = 0;
  for (std::uint64_t frame = 0; frame < 50; ++frame) {
    cv::Mat labels(120, 160, CV_16UC1, cv::Scalar(1));
    degrade_labels(model, {1, 0, frame}, 1, labels);
    const int here = cv::countNonZero(labels != 1);
    EXPECT_LE(here, 2 * 113);  // pixels within 6 of a pixel
    wrong += here;
  }
  EXPECT_GT(wrong, 50 * 20);
}

TEST(SensorPose, ErrorIsBoundedSlowAndNotConstant) {
  SensorModel model = SensorModel::perfect();
  model.position_error_m = 0.03;
  model.rotation_error_deg = 0.3;
  model.pose_error_period_s = 8.0;
  Pose truth = Pose::Identity();
  truth.translation() = Eigen::Vector3d(1, 2, 3);
  truth.linear() =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  double largest_m = 0.0, largest_deg = 0.0;
  Pose last = degrade_pose(model, {1, 0, 0}, 0.0, truth);
  for (int i = 1; i < 6000; ++i) {
    const Pose now = degrade_pose(model, {1, 0, 0}, i / 15.0, truth);
    const Eigen::Vector3d shift = now.translation() - truth.translation();
    const double angle_deg =
        180 / M_PI * Eigen::AngleAxisd(now.linear() * truth.linear().transpose()).angle();
    EXPECT_LE(shift.head<2>().cwiseAbs().maxCoeff(), 0.03 + 1e-12);
    EXPECT_LE(std::abs(shift.z()), 0.01 + 1e-12);
    // Heading 0.3 degrees and a third of it about each other axis: at most 0.3 * sqrt(1 + 2 / 9).
    EXPECT_LE(angle_deg, 0.3316 + 1e-3);
    // The steepest slope of the blend is 1.5 per cell, over at most twice the amplitude.
    EXPECT_LE((now.translation() - last.translation()).cwiseAbs().maxCoeff(),
              0.06 * 1.5 / 8 / 15 + 1e-9);
    largest_m = std::max(largest_m, shift.norm());
    largest_deg = std::max(largest_deg, angle_deg);
    last = now;
  }
  EXPECT_GT(largest_m, 0.02);
  EXPECT_GT(largest_deg, 0.2);
}

}  // namespace
}  // namespace pocd
