#include "pocd/observe/pose_refinement.hpp"

#include <gtest/gtest.h>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::solid;

/// Two boxes that are well known, and frames of them whose pose is given wrongly.
class PoseRefinement : public ::testing::Test {
 protected:
  PoseRefinement() {
    const test::Segmented s = test::segment(test::shoot(scene_, T_W_C_), config_);
    for (const Observation& o : s.observations.list) {
      LibraryObject& object = library_.create(config_.map.voxel_size_m);
      object.class_id = o.class_id;
      object.confirmed = true;
      object.belief = {0.0, 0.1, 9.0, 1.0};
      for (int i = 0; i < 5; ++i) object.model.fuse(o.points, i + 1);
      library_.place(object, o.box);
    }
  }

  /// The correction of a frame whose pose is off by this motion.
  std::optional<Pose> refined(const Scene& scene, const Pose& error) {
    Frame frame = test::shoot(scene, T_W_C_, 1);
    test::add_noise(frame, config_.depth_noise, 5);
    frame.T_W_C = error * frame.T_W_C;
    ThreadPool pool(1);
    organize(frame, 2, config_.map.max_depth_m, config_.classes, ClassTable(config_.classes), pool,
             cloud_);
    return refine_pose(cloud_, library_, config_.map.max_depth_m, config_.depth_noise,
                       config_.pose_refinement);
  }

  static Pose shift(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

  const Eigen::Vector3d size_{0.6, 0.4, 0.6};
  const Scene scene_ = room_with(
      {solid(kBoxClass, {-0.6, 2.2}, size_, 0.5), solid(kBoxClass, {0.6, 2.4}, size_, -0.4)});
  const Pose T_W_C_ = test::look_from({0, 0, 1.1});
  PipelineConfig config_ = test::room_config();
  ObjectLibrary library_;
  OrganizedCloud cloud_;
};

TEST_F(PoseRefinement, RightPoseStays) {
  const auto correction = refined(scene_, Pose::Identity());
  ASSERT_TRUE(correction);
  // Half of what it is asked to repair below.
  EXPECT_LT((*correction * T_W_C_.translation() - T_W_C_.translation()).norm(), 0.01);
}

TEST_F(PoseRefinement, ShiftIsUndoneForTheLargerPart) {
  for (const Pose& error : {shift(0.03, 0, 0), shift(0, 0.04, 0), shift(-0.03, -0.03, 0.005)}) {
    const auto correction = refined(scene_, error);
    ASSERT_TRUE(correction);
    const Eigen::Vector3d given = error * T_W_C_.translation();
    const double before = (given - T_W_C_.translation()).norm();
    const double after = (*correction * given - T_W_C_.translation()).norm();
    // The prior holds the given pose with its own weight, so that part of the error stays.
    EXPECT_LT(after, 0.5 * before) << given.transpose();
  }
}

TEST_F(PoseRefinement, CorrectionMovesPoseAndPointsTogether) {
  const auto correction = refined(scene_, shift(0.03, 0, 0));
  ASSERT_TRUE(correction);
  const Eigen::Vector3f before = cloud_.point_W(5000);
  const Pose T_before = cloud_.T_W_C;
  apply_correction(*correction, cloud_);
  EXPECT_TRUE(cloud_.T_W_C.isApprox(*correction * T_before));
  // Single precision.
  EXPECT_LT((cloud_.point_W(5000).cast<double>() - *correction * before.cast<double>()).norm(),
            1e-5);
}

TEST_F(PoseRefinement, OneMovedThingDoesNotPullThePose) {
  // The left box came 30 cm nearer; the right one tells where the camera is.
  config_.pose_refinement.min_points = 50;
  const auto correction = refined(room_with({solid(kBoxClass, {-0.6, 1.9}, size_, 0.5),
                                             solid(kBoxClass, {0.6, 2.4}, size_, -0.4)}),
                                  Pose::Identity());
  if (correction) {
    EXPECT_LT((*correction * T_W_C_.translation() - T_W_C_.translation()).norm(), 0.015);
  }
}

TEST_F(PoseRefinement, NothingKnownInViewSaysNothing) {
  EXPECT_FALSE(refined(room_with({}), Pose::Identity())) << "what is known is not there";
  library_.erase(library_.all().begin()->first);
  library_.erase(library_.all().begin()->first);
  EXPECT_FALSE(refined(scene_, Pose::Identity()));
}

TEST_F(PoseRefinement, TentativeAndDistrustedObjectsAreNotLeanedOn) {
  for (const auto& [id, object] : library_.all()) object->confirmed = false;
  EXPECT_FALSE(refined(scene_, shift(0.03, 0, 0)));
  for (const auto& [id, object] : library_.all()) {
    object->confirmed = true;
    object->belief = {0.0, 0.1, 1.0, 1.0};
  }
  EXPECT_FALSE(refined(scene_, shift(0.03, 0, 0)));
}

TEST_F(PoseRefinement, LargeCorrectionsAreNotBelieved) {
  config_.pose_refinement.max_correction_m = 0.01;
  EXPECT_FALSE(refined(scene_, shift(0, 0.05, 0)));
}

}  // namespace
}  // namespace pocd
