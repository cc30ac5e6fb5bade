#include "pocd/input/frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "pocd/common/check.hpp"
#include "pocd/input/message_checks.hpp"

namespace pocd {
namespace {

const CameraModel kCamera{4, 3, 10, 11, 1.5, 1.0};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

cv::Mat image(int type, double value) { return cv::Mat(3, 4, type, cv::Scalar::all(value)); }

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

Frame make(const cv::Mat& depth, const cv::Mat& labels = {}, const cv::Mat& color = {},
           const Pose& T_W_C = Pose::Identity(), const CameraModel& camera = kCamera) {
  return make_frame(7, camera, T_W_C, depth, labels, color, "topic x");
}

TEST(Frame, ConvertsMillimetres) {
  cv::Mat depth = image(CV_16UC1, 1234);
  depth.at<std::uint16_t>(0, 0) = 0;
  depth.at<std::uint16_t>(0, 1) = 65535;
  depth.at<std::uint16_t>(0, 2) = 65534;
  const Frame frame = make(depth);
  EXPECT_EQ(frame.stamp_ns, 7);
  EXPECT_EQ(frame.depth_m.type(), CV_32FC1);
  EXPECT_EQ(frame.depth_m.at<float>(0, 0), 0.0f);
  EXPECT_EQ(frame.depth_m.at<float>(0, 1), 0.0f);
  EXPECT_FLOAT_EQ(frame.depth_m.at<float>(0, 2), 65.534f);
  EXPECT_FLOAT_EQ(frame.depth_m.at<float>(2, 3), 1.234f);
}

TEST(Frame, ConvertsMetresAndDropsWhatIsNoReturn) {
  cv::Mat depth = image(CV_32FC1, 1.5);
  const float bad[] = {kNan, kInfinity, -kInfinity, -1.0f};
  for (int u = 0; u < 4; ++u) depth.at<float>(0, u) = bad[u];
  const Frame frame = make(depth);
  for (int u = 0; u < 4; ++u) EXPECT_EQ(frame.depth_m.at<float>(0, u), 0.0f) << u;
  EXPECT_EQ(frame.depth_m.at<float>(1, 0), 1.5f);
  depth.at<float>(1, 0) = 9.0f;  // the frame has a copy of its own
  EXPECT_EQ(frame.depth_m.at<float>(1, 0), 1.5f);
}

TEST(Frame, WidensLabels) {
  EXPECT_EQ(make(image(CV_16UC1, 1), image(CV_8UC1, 200)).labels.at<std::uint16_t>(1, 1), 200);
  EXPECT_EQ(make(image(CV_16UC1, 1), image(CV_16UC1, 4003)).labels.at<std::uint16_t>(1, 1), 4003);
  EXPECT_TRUE(make(image(CV_16UC1, 1)).labels.empty());
}

TEST(Frame, ErrorsNameSourceFieldAndValue) {
  const cv::Mat depth = image(CV_16UC1, 1);
  const cv::Mat small(2, 4, CV_16UC1, cv::Scalar(1));
  Pose nan = Pose::Identity(), scaled = Pose::Identity(), mirrored = Pose::Identity();
  nan.translation().y() = std::nan("");
  scaled.linear() *= 1.01;
  mirrored.linear()(2, 2) = -1.0;
  CameraModel no_focal = kCamera;
  no_focal.fx = 0.0;
  Pose far = Pose::Identity();
  far.translation().x() = -5.1e4;
  const std::pair<std::string, std::string> cases[] = {
      {error_of([&] { make(small); }), "depth image is 4x2"},
      {error_of([&] { make(cv::Mat()); }), "depth image is 0x0"},
      {error_of([&] { make(image(CV_8UC3, 1)); }), "depth image has"},
      {error_of([&] { make(image(CV_64FC1, 1)); }), "depth image has"},
      {error_of([&] { make(depth, small); }), "segmentation image is 4x2"},
      {error_of([&] { make(depth, image(CV_32FC1, 1)); }), "segmentation image has"},
      {error_of([&] { make(depth, {}, cv::Mat(3, 3, CV_8UC3)); }), "color image is 3x3"},
      {error_of([&] { make(depth, {}, image(CV_8UC1, 1)); }), "color image has"},
      {error_of([&] { make(depth, {}, {}, nan); }), "not finite"},
      {error_of([&] { make(depth, {}, {}, far); }), "51000.000000 m away"},
      {error_of([&] { make(depth, {}, {}, scaled); }), "not orthonormal"},
      {error_of([&] { make(depth, {}, {}, mirrored); }), "not orthonormal"},
      {error_of([&] { make(depth, {}, {}, Pose::Identity(), no_focal); }), "fx = 0"},
  };
  for (const auto& [error, expected] : cases) {
    EXPECT_EQ(error.find("topic x"), 0u) << error << " | " << expected;
    EXPECT_NE(error.find(expected), std::string::npos) << error << " | " << expected;
  }
}

TEST(Frame, ValidatesOneThatMakeFrameDidNotMake) {
  const Frame good = make(image(CV_16UC1, 1), image(CV_8UC1, 2), image(CV_8UC3, 3));
  EXPECT_NO_THROW(validate_frame(good, "f"));
  const std::pair<std::string, std::function<void(Frame&)>> defects[] = {
      {"depth image is 0x0", [](Frame& f) { f.depth_m.release(); }},
      {"depth image has OpenCV type 2", [](Frame& f) { f.depth_m = image(CV_16UC1, 1); }},
      {"segmentation image is 3x3", [](Frame& f) { f.labels = cv::Mat(3, 3, CV_16UC1); }},
      {"segmentation image has OpenCV type 0", [](Frame& f) { f.labels = image(CV_8UC1, 1); }},
      {"color image is 4x2", [](Frame& f) { f.color = cv::Mat(2, 4, CV_8UC3); }},
      {"color image has OpenCV type 0", [](Frame& f) { f.color = image(CV_8UC1, 1); }},
      {"pose has a value", [](Frame& f) { f.T_W_C.translation().z() = kNan; }},
      {"camera cy = ", [](Frame& f) { f.camera.cy = kNan; }},
  };
  for (const auto& [expected, spoil] : defects) {
    Frame frame = good;
    spoil(frame);
    EXPECT_EQ(error_of([&] { validate_frame(frame, "f"); }).find("f: " + expected), 0u) << expected;
  }
}

TEST(Camera, ValidatesEveryField) {
  EXPECT_NO_THROW(validate(kCamera, "c"));
  const std::pair<const char*, std::function<void(CameraModel&)>> defects[] = {
      {"width", [](CameraModel& c) { c.width = 0; }},
      {"width", [](CameraModel& c) { c.width = 16385; }},
      {"height", [](CameraModel& c) { c.height = -1; }},
      {"fx", [](CameraModel& c) { c.fx = -1; }},
      {"fx", [](CameraModel& c) { c.fx = std::nan(""); }},
      {"fy", [](CameraModel& c) { c.fy = kInfinity; }},
      {"cx", [](CameraModel& c) { c.cx = kInfinity; }},
      {"cy", [](CameraModel& c) { c.cy = std::nan(""); }},
      {"fx = 0.190000, not in [0.200000, 400.000000]", [](CameraModel& c) { c.fx = 0.19; }},
      {"fy", [](CameraModel& c) { c.fy = 301.0; }},
      {"cx", [](CameraModel& c) { c.cx = 8.1; }},
      {"cy = -3.100000, not in [-3.000000, 6.000000]", [](CameraModel& c) { c.cy = -3.1; }},
  };
  for (const auto& [field, spoil] : defects) {
    CameraModel camera = kCamera;
    spoil(camera);
    const std::string error = error_of([&] { validate(camera, "c"); });
    EXPECT_NE(error.find(field), std::string::npos) << error;
  }
}

// A camera info is held to the same bounds: a principal point far away would make a frame cost
// gigabytes.
TEST(Camera, InfoWithAnOffPrincipalPointIsRefused) {
  CameraInfoFields info;
  info.width = 640;
  info.height = 360;
  info.k = {461, 0, 1e7, 0, 461, 180, 0, 0, 1};
  const auto off = camera_model(info);
  ASSERT_TRUE(off.problem);
  EXPECT_EQ(off.problem->reason, InputReason::kBadIntrinsics);
  EXPECT_EQ(off.problem->detail, "camera cx = 10000000.000000, not in [-640.000000, 1280.000000]");
  info.k[2] = 319.5;
  EXPECT_TRUE(camera_model(info).value);
}

TEST(Camera, BackProjectsThroughThePrincipalPoint) {
  EXPECT_EQ(kCamera.back_project(1.5, 1.0, 2.0), Eigen::Vector3d(0, 0, 2));
  EXPECT_EQ(kCamera.back_project(11.5, 12.0, 3.0), Eigen::Vector3d(3, 3, 3));
}

}  // namespace
}  // namespace pocd
