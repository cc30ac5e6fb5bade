#include "pocd/segmentation/organized_cloud.hpp"

#include <gtest/gtest.h>

#include "test_room.hpp"

namespace pocd {
namespace {

/// 4 x 4 image without a return, labelled box.
Frame blank_frame() {
  Frame frame;
  frame.camera = {4, 4, 10.0, 20.0, 1.5, 2.5};
  frame.depth_m = cv::Mat::zeros(4, 4, CV_32FC1);
  frame.labels = cv::Mat(4, 4, CV_16UC1, cv::Scalar(test::kBoxClass));
  return frame;
}

OrganizedCloud organized(const Frame& frame, int stride, const ClassMap& classes,
                         double max_depth_m = 4.0) {
  OrganizedCloud cloud;
  ThreadPool pool(1);
  organize(frame, stride, max_depth_m, classes, ClassTable(classes), pool, cloud);
  return cloud;
}

TEST(Organize, CellTakesItsFirstReturnInRowOrder) {
  Frame frame = blank_frame();
  // Cell (0, 0): second pixel of its first row comes before the first pixel of its second row.
  frame.depth_m.at<float>(0, 1) = 2.0f;
  frame.depth_m.at<float>(1, 0) = 1.0f;
  frame.labels.at<std::uint16_t>(0, 1) = test::kCageClass;
  // Cell (1, 1): only its last pixel.
  frame.depth_m.at<float>(3, 3) = 3.0f;
  const OrganizedCloud cloud = organized(frame, 2, test::room_classes());
  ASSERT_EQ(cloud.width, 2);
  ASSERT_EQ(cloud.height, 2);
  EXPECT_EQ(cloud.depth_m, (std::vector<float>{2.0f, 0.0f, 0.0f, 3.0f}));
  EXPECT_EQ(cloud.label[0], test::kCageClass) << "the label is that of the pixel taken";
  EXPECT_EQ(cloud.kind[0], PixelKind::kObject);
  EXPECT_EQ(cloud.kind[1], PixelKind::kNone);
}

TEST(Organize, PointsAreThoseOfTheRayOfThePixelTaken) {
  Frame frame = blank_frame();
  frame.depth_m.at<float>(3, 3) = 3.0f;
  frame.T_W_C = test::look_from({1.0, -2.0, 0.5}, 0.4, 0.2);
  const OrganizedCloud cloud = organized(frame, 2, test::room_classes());
  const Eigen::Vector3d expected = frame.T_W_C * frame.camera.back_project(3, 3, 3.0);
  // Single precision at coordinates of a few metres: 2^-22 of them; ten times that.
  EXPECT_LT((cloud.point_W(3).cast<double>() - expected).norm(), 5e-6);
}

TEST(Organize, BeyondTheDepthLimitIsKeptAsDepthAlone) {
  Frame frame = blank_frame();
  frame.depth_m.at<float>(0, 0) = 4.0f;
  frame.depth_m.at<float>(0, 2) = 4.5f;
  const OrganizedCloud cloud = organized(frame, 2, test::room_classes());
  EXPECT_EQ(cloud.kind[0], PixelKind::kObject) << "at the limit";
  EXPECT_EQ(cloud.kind[1], PixelKind::kNone);
  EXPECT_EQ(cloud.depth_m[1], 4.5f) << "free space in front of it is still known to be free";
}

TEST(Organize, KindsFollowRoles) {
  Frame frame = blank_frame();
  frame.depth_m.setTo(1.0);
  const std::vector<std::pair<ClassId, PixelKind>> cases = {
      {test::kWallClass, PixelKind::kBackground}, {test::kFloorClass, PixelKind::kGround},
      {test::kRobotClass, PixelKind::kIgnore},    {test::kPersonClass, PixelKind::kDynamic},
      {test::kFenceAlias, PixelKind::kObject},    {99, PixelKind::kBackground}};
  for (const auto& [label, kind] : cases) {
    frame.labels.setTo(label);
    EXPECT_EQ(organized(frame, 1, test::room_classes()).kind[5], kind) << label;
  }
  frame.labels.setTo(test::kFenceAlias);
  EXPECT_EQ(organized(frame, 1, test::room_classes()).label[5], test::kFenceClass);
}

TEST(Organize, PanopticLabelsCarryInstances) {
  ClassMap classes = test::room_classes();
  classes.label_divisor = 100;
  Frame frame = blank_frame();
  frame.depth_m.setTo(1.0);
  frame.labels.setTo(test::kFenceAlias * 100 + 42);
  const OrganizedCloud cloud = organized(frame, 1, classes);
  EXPECT_EQ(cloud.label[0], test::kFenceClass);
  EXPECT_EQ(cloud.instance[0], 42);
}

TEST(Organize, WithoutMasksEverythingIsTheDefaultClass) {
  ClassMap classes = test::room_classes();
  classes.default_class = test::kFenceAlias;
  Frame frame = blank_frame();
  frame.depth_m.setTo(1.0);
  frame.labels = cv::Mat();
  const OrganizedCloud cloud = organized(frame, 1, classes);
  EXPECT_EQ(cloud.label[0], test::kFenceClass) << "aliases hold for the default class, too";
  EXPECT_EQ(cloud.kind[0], PixelKind::kObject);
}

TEST(Organize, SameForEveryThreadCountAndForReusedMemory) {
  const Frame frame =
      test::shoot(test::room_with({test::solid(test::kBoxClass, {0, 2.2}, {0.5, 0.4, 0.6}, 0.3)}),
                  test::look_from({0, 0, 1}));
  const ClassMap classes = test::room_classes();
  const OrganizedCloud expected = organized(frame, 2, classes);
  for (const int threads : {2, 3}) {
    ThreadPool pool(threads);
    OrganizedCloud cloud;
    organize(blank_frame(), 1, 4.0, classes, ClassTable(classes), pool, cloud);
    organize(frame, 2, 4.0, classes, ClassTable(classes), pool, cloud);
    EXPECT_EQ(cloud.depth_m, expected.depth_m);
    EXPECT_EQ(cloud.x_W, expected.x_W);
    EXPECT_EQ(cloud.z_W, expected.z_W);
    EXPECT_EQ(cloud.label, expected.label);
    EXPECT_EQ(cloud.kind, expected.kind);
  }
}

TEST(ViewBall, HoldsTheFrustumOfAnUprightAndOffCentreCamera) {
  OrganizedCloud cloud;
  cloud.width = 180, cloud.height = 320;
  cloud.camera = {180, 320, 230.0, 230.0, 30.0, 250.0};
  cloud.T_W_C.translation() = Eigen::Vector3d(1, 2, 3);
  const double reach_m = 10.0;
  const ViewBall ball = view_ball(cloud, reach_m);
  for (const double u : {0.0, 180.0}) {
    for (const double v : {0.0, 320.0}) {
      const Eigen::Vector3d corner_C(reach_m * (u - 30.0) / 230.0, reach_m * (v - 250.0) / 230.0,
                                     reach_m);
      EXPECT_LE((cloud.T_W_C * corner_C - ball.center_W).norm(), ball.radius_m + 1e-9);
    }
  }
}

}  // namespace
}  // namespace pocd
