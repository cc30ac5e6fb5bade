#include "pocd/observe/free_space.hpp"

#include <gtest/gtest.h>

#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kPersonClass;
using test::room_with;
using test::shoot;
using test::solid;

constexpr double kCell_m = 0.1;
const Eigen::Vector3f kPlace(0.0f, 2.3f, 0.8f);  ///< in full view, before the wall

class FreeSpaceTest : public ::testing::Test {
 protected:
  void take(const Frame& frame) {
    const test::Segmented s = test::segment(frame, config_);
    DepthField field;
    field.update(s.cloud);
    free_.update(s.cloud, field, config_.depth_noise, config_.map.max_depth_m,
                 config_.change.pose_tolerance_m);
  }
  void look(const Scene& scene, int times = 1) {
    for (int i = 0; i < times; ++i) take(shoot(scene, eye_, count_++));
  }

  PipelineConfig config_ = test::room_config();
  Pose eye_ = test::look_from({0, 0, 1.0}, 0.0, 0.15);
  FreeSpace free_{kCell_m};
  std::uint64_t count_ = 0;
};

/// A thing whose front face is at kPlace.
SceneObject at_the_place(ClassId class_id = kBoxClass) {
  return solid(class_id, {0.0, 2.5}, {0.8, 0.4, 1.2});
}

TEST_F(FreeSpaceTest, ACellCountsAfterSomeLooksOnly) {
  EXPECT_FALSE(free_.seen_empty(kPlace)) << "nobody looked";
  for (int i = 1; i <= 5; ++i) {
    look(room_with({}));
    EXPECT_EQ(free_.seen_empty(kPlace), i >= FreeSpace::kLooks) << i;
  }
  EXPECT_GT(free_.block_count(), 0u);
}

TEST_F(FreeSpaceTest, BehindWhatArrivedNothingIsKnown) {
  look(room_with({}), 5);
  const Eigen::Vector3f eye_W = eye_.translation().cast<float>();
  const Eigen::Vector3f along = (kPlace - eye_W).normalized();
  const Eigen::Vector3f surface_W = eye_W + 1.5f * along;
  const auto at = [&](float beyond_m) { return Eigen::Vector3f(surface_W + beyond_m * along); };
  free_.forget_behind(eye_W, surface_W, 0.5);
  EXPECT_TRUE(free_.seen_empty(at(-0.3f))) << "before it";
  for (const float beyond_m : {0.0f, 0.2f, 0.5f}) EXPECT_FALSE(free_.seen_empty(at(beyond_m)));
  EXPECT_TRUE(free_.seen_empty(at(0.7f))) << "farther than it can be deep";
  look(room_with({}), FreeSpace::kLooks);
  EXPECT_TRUE(free_.seen_empty(at(0.2f))) << "seen empty again";
}

TEST_F(FreeSpaceTest, WhatIsNotInViewIsNotSeenEmpty) {
  look(room_with({}), 5);
  EXPECT_FALSE(free_.seen_empty({0.0f, 3.9f, 0.8f})) << "behind the wall";
  EXPECT_FALSE(free_.seen_empty({0.0f, -1.0f, 0.8f})) << "behind the camera";
  EXPECT_FALSE(free_.seen_empty({4.0f, 2.3f, 0.8f})) << "beside the picture";
  EXPECT_FALSE(free_.seen_empty({0.0f, 3.5f, 0.8f})) << "the wall";
  EXPECT_FALSE(free_.seen_empty({0.0f, 2.3f, 0.0f})) << "the floor";
  config_.map.max_depth_m = 2.0;
  free_ = FreeSpace(kCell_m);
  look(room_with({}), 5);
  EXPECT_FALSE(free_.seen_empty(kPlace)) << "beyond the depth limit";
  EXPECT_TRUE(free_.seen_empty({0.0f, 1.7f, 0.8f}));
}

TEST_F(FreeSpaceTest, HiddenPlacesAreNotSeenEmpty) {
  look(room_with({solid(kBoxClass, {0.0, 1.5}, {1.0, 0.2, 1.6})}), 5);
  EXPECT_FALSE(free_.seen_empty(kPlace));
  EXPECT_TRUE(free_.seen_empty({0.0f, 1.1f, 0.8f})) << "before the screen";
}

TEST_F(FreeSpaceTest, AHoleSaysNothing) {
  for (int i = 0; i < 5; ++i) {
    Frame frame = shoot(room_with({}), eye_, count_++);
    frame.depth_m.setTo(0.0f);
    take(frame);
  }
  EXPECT_FALSE(free_.seen_empty(kPlace));
  EXPECT_EQ(free_.block_count(), 0u) << "and costs nothing";
  // Nor does it take away what is known.
  look(room_with({}), FreeSpace::kLooks);
  Frame frame = shoot(room_with({}), eye_, count_++);
  frame.depth_m.setTo(0.0f);
  take(frame);
  EXPECT_TRUE(free_.seen_empty(kPlace));
}

TEST_F(FreeSpaceTest, AMovingThingSaysNothing) {
  // Its depth and its mask are not of the same instant: neither before nor at it.
  const Scene scene = room_with({solid(kPersonClass, {0.0, 2.8}, {3.0, 0.2, 2.5})});
  look(scene, 5);
  EXPECT_FALSE(free_.seen_empty(kPlace));
  // Nor does a person who stands in a free place make it taken.
  look(room_with({}), FreeSpace::kLooks);
  look(room_with({at_the_place(kPersonClass)}), 2);
  EXPECT_TRUE(free_.seen_empty(kPlace));
}

TEST_F(FreeSpaceTest, WhatWasMeasuredStartsAnew) {
  look(room_with({}), 20);
  ASSERT_TRUE(free_.seen_empty(kPlace));
  look(room_with({at_the_place()}));
  EXPECT_FALSE(free_.seen_empty(kPlace)) << "one look at a thing is enough, after however many";
  look(room_with({}), FreeSpace::kLooks - 1);
  EXPECT_FALSE(free_.seen_empty(kPlace));
  look(room_with({}));
  EXPECT_TRUE(free_.seen_empty(kPlace));
}

// Noisy looks with wandering poses: no surface of a thing that stands there is ever seen empty.
TEST_F(FreeSpaceTest, SurfacesOfStillThingsAreNeverSeenEmpty) {
  int asked = 0, free_asked = 0, free_found = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    free_ = FreeSpace(kCell_m);
    std::vector<SceneObject> things;
    std::vector<Eigen::Vector3d> centers, sizes;
    std::vector<double> yaws;
    for (int k = 0; k < 3; ++k) {
      centers.emplace_back(-0.9 + 0.9 * k, random.uniform(1.9, 2.6), 0.0);
      sizes.emplace_back(random.uniform(0.2, 0.5), random.uniform(0.2, 0.5),
                         random.uniform(0.4, 1.2));
      yaws.push_back(random.uniform(-1.5, 1.5));
      things.push_back(solid(kBoxClass, centers[k].head<2>(), sizes[k], yaws[k]));
    }
    const Scene scene = room_with(things);
    for (int i = 0; i < 12; ++i) {
      Frame frame = shoot(scene, test::swaying_camera(static_cast<std::uint64_t>(3 * i)), count_++);
      test::add_noise(frame, config_.depth_noise, seed);
      for (int d = 0; d < 3; ++d) frame.T_W_C.translation()[d] += random.uniform(-0.01, 0.01);
      take(frame);
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Rotation2Dd turn(yaws[k]);
      for (int n = 0; n < 400; ++n) {
        // On a side or the top.
        Eigen::Vector3d at(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform());
        if (n % 3 == 0) {
          at.z() = 1.0;
        } else {
          at[n % 2] = random.below(2) ? 0.5 : -0.5;
        }
        at = at.cwiseProduct(sizes[k]);
        Eigen::Vector3d p = centers[k];
        p.head<2>() += turn * at.head<2>();
        p.z() += at.z();
        ASSERT_FALSE(free_.seen_empty(p.cast<float>())) << "seed " << seed << ": " << p.transpose();
        ++asked;
      }
    }
    for (int n = 0; n < 200; ++n) {  // what lies well before all things, within the picture
      const Eigen::Vector3f p(static_cast<float>(random.uniform(-0.4, 0.4)),
                              static_cast<float>(random.uniform(1.0, 1.4)),
                              static_cast<float>(random.uniform(0.5, 0.9)));
      ++free_asked;
      free_found += free_.seen_empty(p);
    }
  }
  EXPECT_EQ(asked, 6 * 3 * 400);
  EXPECT_EQ(free_found, free_asked) << "and free places are";
}

// Driven over again and again at three headings.
TEST_F(FreeSpaceTest, MemoryFollowsTheSpaceNotTheTime) {
  std::size_t after_once = 0;
  for (int round = 0; round < 6; ++round) {
    for (const double yaw_rad : {-0.6, 0.0, 0.6}) {
      for (const double x : {-0.5, 0.0, 0.5}) {
        eye_ = test::look_from({x, 0, 1.0}, yaw_rad, 0.15);
        look(room_with({}));
      }
    }
    if (round == 0) after_once = free_.block_count();
  }
  ASSERT_GT(after_once, 10u);
  EXPECT_EQ(free_.block_count(), after_once);
  // At most the blocks of the box around all that was in view: 4 m deep, to both sides, high and
  // low.
  const double block_m = 8.0 * kCell_m;
  const double around = (9.0 / block_m + 2) * (4.0 / block_m + 2) * (6.0 / block_m + 2);
  EXPECT_LT(static_cast<double>(after_once), around);
}

// A localisation that drifts away for ever.
TEST_F(FreeSpaceTest, ItsMemoryHasAnEndWhereverPosesWander) {
  look(room_with({}), FreeSpace::kLooks);
  const std::size_t most = free_.block_count();
  EXPECT_FALSE(free_.problem());
  free_ = FreeSpace(kCell_m, most);
  Scene room = room_with({});
  const auto wander = [&](double x_m) {
    for (SceneObject& thing : room.objects) thing.T_W_O.pretranslate(Eigen::Vector3d(x_m, 0, 0));
    eye_.pretranslate(Eigen::Vector3d(x_m, 0, 0));
  };
  look(room, FreeSpace::kLooks);
  EXPECT_EQ(free_.left_out(), 0u);
  for (int i = 0; i < 5; ++i) {
    wander(20.0);
    look(room);
    EXPECT_EQ(free_.block_count(), most);
    EXPECT_GT(free_.left_out(), most / 2) << "of as much space as before, but for the grid";
    ASSERT_TRUE(free_.problem());
    EXPECT_NE(free_.problem()->find("no room for " + std::to_string(free_.left_out())),
              std::string::npos)
        << *free_.problem();
  }
  EXPECT_TRUE(free_.seen_empty(kPlace)) << "what was known is kept";
  EXPECT_FALSE(free_.seen_empty(kPlace + Eigen::Vector3f(100.0f, 0.0f, 0.0f)));
  wander(-100.0);
  look(room);
  EXPECT_EQ(free_.left_out(), 0u);
}

}  // namespace
}  // namespace pocd
