#include "pocd/association/associate.hpp"

#include <gtest/gtest.h>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::room_with;
using test::shoot;
using test::solid;

const Eigen::Vector3d kSize(0.6, 0.4, 0.6);

/// A library of what some frames showed, asked what another frame says about it.
class Associate : public ::testing::Test {
 protected:
  /// Enters everything seen in this scene, from three viewpoints, as known objects.
  void learn(const Scene& scene) {
    for (const double x : {-0.3, 0.0, 0.3}) {
      const test::Segmented s = segmented(scene, test::look_from({x, 0, 1.1}));
      for (const Observation& o : s.observations.list) {
        LibraryObject* object = nullptr;
        for (const auto& [id, known] : library_.all()) {
          if (box_overlap(known->box, o.box, 0.1) > 0.2 && known->class_id == o.class_id)
            object = known.get();
        }
        if (!object) object = &library_.create(config_.map.voxel_size_m);
        object->class_id = o.class_id;
        object->confirmed = true;
        ++object->observations;
        object->model.fuse(o.points);
        Points points, normals;
        for (const Surfel& surfel : object->model.surfels()) {
          points.push_back(surfel.point_W);
          normals.push_back(surfel.normal_W);
        }
        library_.place(*object, fit_box(points, normals, 0.005));
      }
    }
  }

  /// Associates a frame of the scene with all of the library.
  AssociationResult look(const Scene& scene) {
    now_ = segmented(scene, viewpoint_);
    DepthField field;
    field.update(now_.cloud);
    candidates_.clear();
    for (const auto& [id, object] : library_.all()) {
      Candidate candidate;
      candidate.object = object.get();
      sight_object(
          object->model, object->class_id, 1, now_.cloud, field, now_.observations,
          {0.5 * config_.change.tau_m, config_.change.pose_tolerance_m, config_.map.max_depth_m},
          config_.depth_noise, candidate.sighting);
      candidates_.push_back(candidate);
    }
    return associate(candidates_.data(), candidates_.size(), now_.observations, viewpoint_,
                     config_.association);
  }

  test::Segmented segmented(const Scene& scene, const Pose& T_W_C) {
    Frame frame = shoot(scene, T_W_C, frame_count_++);
    test::add_noise(frame, config_.depth_noise, 7);
    return test::segment(frame, config_);
  }

  const LibraryObject& object_of(const Match& match) const {
    return *candidates_[match.candidate].object;
  }

  PipelineConfig config_ = test::room_config();
  Pose viewpoint_ = test::look_from({0.1, 0, 1.1});
  ObjectLibrary library_;
  test::Segmented now_;
  std::vector<Candidate> candidates_;
  std::uint64_t frame_count_ = 0;
};

TEST_F(Associate, ObjectInPlaceMatchesWithoutMotion) {
  const Scene scene =
      room_with({solid(kBoxClass, {-0.6, 2.3}, kSize), solid(kBoxClass, {0.6, 2.5}, kSize, 0.4)});
  learn(scene);
  ASSERT_EQ(library_.size(), 2u);
  const AssociationResult result = look(scene);
  ASSERT_EQ(result.matches.size(), 2u);
  for (const Match& match : result.matches) {
    EXPECT_TRUE(match.stationary);
    EXPECT_EQ(match.displacement_m, 0.0);
    EXPECT_TRUE(match.T_new_old.isApprox(Pose::Identity()));
    EXPECT_FALSE(object_of(match).icp_target) << "no alignment was prepared, so none was made";
    const Eigen::Vector3d apart = object_of(match).box.pose.position_W -
                                  now_.observations.list[match.observation].box.pose.position_W;
    EXPECT_LT(apart.norm(), 0.15);
  }
  EXPECT_EQ(result.doubtful, (std::vector<bool>{false, false}));
  EXPECT_TRUE(result.unassigned.empty());
}

TEST_F(Associate, MovedBoxIsMatchedWithItsDisplacement) {
  learn(room_with({solid(kBoxClass, {-0.2, 2.3}, kSize)}));
  const AssociationResult result = look(room_with({solid(kBoxClass, {0.4, 2.2}, kSize)}));
  ASSERT_EQ(result.matches.size(), 1u);
  const Match& match = result.matches[0];
  EXPECT_FALSE(match.stationary);
  EXPECT_TRUE(result.doubtful[0]);
  // Half a voxel of surfel spacing and 2 cm of depth noise averaged over some hundred points.
  EXPECT_NEAR(match.displacement_m, std::hypot(0.6, 0.1), 0.05);
  EXPECT_LT(
      (match.T_new_old * Eigen::Vector3d(-0.2, 2.3, 0.3) - Eigen::Vector3d(0.4, 2.2, 0.3)).norm(),
      0.05);
  EXPECT_EQ(match.sign, 1) << "it came nearer to the camera";
  EXPECT_LE(match.cost, config_.association.cutoff_cost);
}

TEST_F(Associate, SignTellsFartherFromNearer) {
  learn(room_with({solid(kBoxClass, {0, 2.2}, kSize)}));
  const AssociationResult result = look(room_with({solid(kBoxClass, {0.1, 2.8}, kSize)}));
  ASSERT_EQ(result.matches.size(), 1u);
  EXPECT_EQ(result.matches[0].sign, -1);
}

TEST_F(Associate, DifferentClassesNever) {
  // The box is gone; a cage of its size stands in its place, another beside it.
  learn(room_with({solid(kBoxClass, {0, 2.3}, kSize)}));
  const AssociationResult result =
      look(room_with({solid(kCageClass, {0, 2.3}, kSize), solid(kCageClass, {0.75, 2.3}, kSize)}));
  EXPECT_TRUE(result.matches.empty());
  EXPECT_TRUE(result.pieces.empty());
  EXPECT_EQ(result.unassigned.size(), 2u);
}

TEST_F(Associate, FartherThanTheGateIsAnotherThing) {
  config_.association.max_distance_m = 0.5;
  learn(room_with({solid(kBoxClass, {-0.4, 2.3}, kSize)}));
  const AssociationResult result = look(room_with({solid(kBoxClass, {0.4, 2.3}, kSize)}));
  EXPECT_TRUE(result.matches.empty());
  EXPECT_EQ(result.unassigned.size(), 1u);
  EXPECT_TRUE(result.doubtful[0]) << "its place is seen empty all the same";
}

TEST_F(Associate, AnUnlikeThingIsNotTheMovedOne) {
  // A low, wide thing of the class beside the empty place does not fit the tall one.
  learn(room_with({solid(kBoxClass, {-0.2, 2.3}, {0.4, 0.4, 1.2})}));
  const AssociationResult result =
      look(room_with({solid(kBoxClass, {0.4, 2.2}, {1.0, 0.8, 0.3}, 0.5)}));
  EXPECT_TRUE(result.matches.empty());
}

TEST_F(Associate, HiddenObjectIsNeitherMatchedNorInDoubt) {
  learn(room_with({solid(kBoxClass, {0, 2.6}, kSize)}));
  const AssociationResult result = look(
      room_with({solid(kBoxClass, {0, 2.6}, kSize), solid(kCageClass, {0, 1.3}, {1.4, 0.2, 1.4})}));
  EXPECT_TRUE(result.matches.empty());
  EXPECT_FALSE(result.doubtful[0]);
}

TEST_F(Associate, PiecesOfAnObjectAreNotNewThings) {
  // A post before the middle of a long box cuts its observation in two.
  const SceneObject box = solid(kBoxClass, {0, 2.6}, {1.8, 0.3, 0.7});
  learn(room_with({box}));
  ASSERT_EQ(library_.size(), 1u);
  const AssociationResult result =
      look(room_with({box, solid(kCageClass, {0, 1.7}, {0.15, 0.15, 1.5})}));
  ASSERT_EQ(result.matches.size(), 1u);
  EXPECT_EQ(candidates_[result.matches[0].candidate].object->class_id, kBoxClass);
  int new_boxes = 0;
  for (const std::int32_t j : result.unassigned)
    new_boxes += now_.observations.list[j].class_id == kBoxClass;
  EXPECT_EQ(new_boxes, 0);
  int seen_boxes = 0;
  for (const Observation& o : now_.observations.list) seen_boxes += o.class_id == kBoxClass;
  EXPECT_EQ(result.pieces.size(), static_cast<std::size_t>(seen_boxes - 1));
}

TEST_F(Associate, EveryObservationIsMatchedOnceOrNamed) {
  learn(room_with({solid(kBoxClass, {-0.8, 2.3}, kSize), solid(kBoxClass, {0.1, 2.6}, kSize),
                   solid(kCageClass, {0.9, 2.3}, kSize)}));
  const AssociationResult result = look(
      room_with({solid(kBoxClass, {-0.8, 2.3}, kSize), solid(kBoxClass, {0.5, 2.3}, kSize, 0.3),
                 solid(kCageClass, {1.0, 2.9}, {0.3, 0.3, 1.2})}));
  std::vector<int> times(now_.observations.list.size(), 0);
  for (const Match& match : result.matches) ++times[match.observation];
  for (const auto& piece : result.pieces) ++times[piece.observation];
  for (const std::int32_t j : result.unassigned) ++times[j];
  for (const int n : times) EXPECT_EQ(n, 1);
  EXPECT_EQ(result.doubtful.size(), candidates_.size());
  for (std::size_t i = 1; i < result.matches.size(); ++i) {
    EXPECT_LT(result.matches[i - 1].candidate, result.matches[i].candidate);
  }
}

TEST_F(Associate, AlignInPlaceFindsSmallMotions) {
  learn(room_with({solid(kBoxClass, {0, 2.3}, kSize, 0.3)}));
  LibraryObject& object = *library_.all().begin()->second;
  const auto aligned = [&](const SceneObject& now) {
    now_ = segmented(room_with({now}), viewpoint_);
    return align_in_place(object, now_.observations.list.at(0), viewpoint_, config_.association);
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

TEST_F(Associate, AlignInPlaceSaysWhenItDoesNotFit) {
  learn(room_with({solid(kBoxClass, {0, 2.3}, kSize)}));
  LibraryObject& object = *library_.all().begin()->second;
  now_ = segmented(room_with({solid(kBoxClass, {0, 2.3}, {1.4, 0.3, 1.2}, 0.7)}), viewpoint_);
  EXPECT_FALSE(
      align_in_place(object, now_.observations.list.at(0), viewpoint_, config_.association));
  EXPECT_FALSE(align_in_place(object, {}, viewpoint_, config_.association)) << "no points";
}

TEST_F(Associate, NothingInNothingOut) {
  const AssociationResult result = look(room_with({}));
  EXPECT_TRUE(result.matches.empty());
  EXPECT_TRUE(result.unassigned.empty());
  EXPECT_TRUE(result.doubtful.empty());
}

}  // namespace
}  // namespace pocd
