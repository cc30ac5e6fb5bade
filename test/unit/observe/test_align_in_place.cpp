#include "pocd/observe/align_in_place.hpp"

#include <gtest/gtest.h>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::shoot;
using test::solid;

const Eigen::Vector3d kSize(0.6, 0.4, 0.6);

/// An object made of what three frames showed, aligned with what another frame shows.
class AlignInPlace : public ::testing::Test {
 protected:
  /// Makes the library's only object of this thing, seen from three viewpoints.
  void learn(const SceneObject& thing) {
    LibraryObject& object = library_.create(config_.map.voxel_size_m);
    object.class_id = thing.class_id;
    for (const double x : {-0.3, 0.0, 0.3}) {
      const test::Segmented s = segmented(room_with({thing}), test::look_from({x, 0, 1.1}));
      object.model.fuse(s.observations.list.at(0).points, ++object.observations);
    }
    Points points, normals;
    for (const Surfel& surfel : object.model.surfels()) {
      points.push_back(surfel.point_W);
      normals.push_back(surfel.normal_W);
    }
    library_.place(object, fit_box(points, normals, 0.005));
  }

  test::Segmented segmented(const Scene& scene, const Pose& T_W_C) {
    Frame frame = shoot(scene, T_W_C, frame_count_++);
    test::add_noise(frame, config_.depth_noise, 7);
    return test::segment(frame, config_);
  }

  PipelineConfig config_ = test::room_config();
  Pose viewpoint_ = test::look_from({0.1, 0, 1.1});
  ObjectLibrary library_;
  test::Segmented now_;
  std::uint64_t frame_count_ = 0;
};

TEST_F(AlignInPlace, FindsSmallMotions) {
  learn(solid(kBoxClass, {0, 2.3}, kSize, 0.3));
  LibraryObject& object = *library_.all().begin()->second;
  const auto aligned = [&](const SceneObject& now, const Pose& start = Pose::Identity()) {
    now_ = segmented(room_with({now}), viewpoint_);
    return align_in_place(object, now_.observations.list.at(0), viewpoint_, start,
                          config_.association);
  };
  // The alignment of the same surface twice under noise: below half a voxel.
  const auto still = aligned(solid(kBoxClass, {0, 2.3}, kSize, 0.3));
  ASSERT_TRUE(still);
  EXPECT_LT(still->displacement_m, 0.025);
  const auto nearer = aligned(solid(kBoxClass, {0.03, 2.22}, kSize, 0.3));
  ASSERT_TRUE(nearer);
  EXPECT_NEAR(nearer->displacement_m, std::hypot(0.03, 0.08), 0.03);
  EXPECT_EQ(nearer->sign, 1);
  const auto turned = aligned(solid(kBoxClass, {0, 2.3}, kSize, 0.5));
  ASSERT_TRUE(turned);
  EXPECT_NEAR(Eigen::AngleAxisd(turned->T_new_old.linear()).angle(), 0.2, 0.05);
}

TEST_F(AlignInPlace, SaysWhenItDoesNotFit) {
  learn(solid(kBoxClass, {0, 2.3}, kSize));
  LibraryObject& object = *library_.all().begin()->second;
  now_ = segmented(room_with({solid(kBoxClass, {0, 2.3}, {1.4, 0.3, 1.2}, 0.7)}), viewpoint_);
  EXPECT_FALSE(align_in_place(object, now_.observations.list.at(0), viewpoint_, Pose::Identity(),
                              config_.association));
  EXPECT_FALSE(align_in_place(object, {}, viewpoint_, Pose::Identity(), config_.association))
      << "no points";
}

}  // namespace
}  // namespace pocd
