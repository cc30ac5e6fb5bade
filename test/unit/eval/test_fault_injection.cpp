#include "pocd/eval/fault_injection.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace pocd {
namespace {

Frame good_frame(double time_s) {
  Frame frame;
  frame.stamp_ns = static_cast<StampNs>(time_s * 1e9);
  frame.depth_m = cv::Mat(60, 80, CV_32FC1, cv::Scalar(2.0));
  frame.labels = cv::Mat(60, 80, CV_16UC1, cv::Scalar(7));
  return frame;
}

TEST(FaultInjection, DoesNothingUnlessAsked) {
  Frame frame = good_frame(100.0);
  inject_faults(FaultOptions(), 0, frame);
  EXPECT_FALSE(frame.labels.empty());
  EXPECT_TRUE(frame.T_W_C.isApprox(Pose::Identity()));
}

TEST(FaultInjection, PoseJumpsAreShortAndOfTheGivenLength) {
  FaultOptions options;
  options.pose_jumps = true;
  int jumped = 0;
  const int frames = 15 * 60;
  for (int i = 0; i < frames; ++i) {
    Frame frame = good_frame(i / 15.0);
    inject_faults(options, 0, frame);
    const double shift_m = frame.T_W_C.translation().norm();
    if (shift_m == 0.0) continue;
    EXPECT_NEAR(shift_m, 0.3, 1e-9);
    ++jumped;
  }
  // 10 episodes (one every 6 s after the first 3 s) of one to five frames.
  EXPECT_GE(jumped, 9);
  EXPECT_LE(jumped, 51);
}

TEST(FaultInjection, MaskGapsLastTwoSeconds) {
  FaultOptions options;
  options.mask_gaps = true;
  int without = 0;
  for (int i = 0; i < 15 * 6; ++i) {
    Frame frame = good_frame(3.0 + i / 15.0);
    inject_faults(options, 0, frame);
    without += frame.labels.empty();
  }
  EXPECT_EQ(without, 30);
}

TEST(FaultInjection, HalfOfTheDepthIsLostAndTheSourceKeepsItsImage) {
  FaultOptions options;
  options.depth_holes = true;
  const Frame source = good_frame(3.5);
  Frame frame = source, again = source;
  inject_faults(options, 0, frame);
  inject_faults(options, 0, again);
  EXPECT_EQ(cv::countNonZero(source.depth_m), 4800);
  EXPECT_NEAR(cv::countNonZero(frame.depth_m), 2400, 5 * 35);  // five sigma of 4800 coins
  EXPECT_EQ(cv::norm(frame.depth_m, again.depth_m, cv::NORM_L1), 0.0)
      << "the same frame, the same holes";
}

TEST(FaultInjection, ChosenFaultsTakeTurns) {
  FaultOptions options;
  options.mask_gaps = options.depth_holes = true;
  Frame first = good_frame(3.5), second = good_frame(9.5);
  inject_faults(options, 0, first);
  inject_faults(options, 0, second);
  EXPECT_TRUE(first.labels.empty());
  EXPECT_EQ(cv::countNonZero(first.depth_m), 4800);
  EXPECT_FALSE(second.labels.empty());
  EXPECT_LT(cv::countNonZero(second.depth_m), 4800);
}

}  // namespace
}  // namespace pocd
