#include "pocd/map/view_memory.hpp"

#include <gtest/gtest.h>

namespace pocd {
namespace {

constexpr StampNs kSecond = 1'000'000'000;

/// A camera at the origin that looks along +x at a wall in front.
OrganizedCloud wall_at(double distance_m) {
  OrganizedCloud cloud;
  cloud.width = 80;
  cloud.height = 48;
  cloud.camera = CameraModel{80, 48, 60.0, 60.0, 39.5, 23.5};
  cloud.T_W_C.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  cloud.T_W_C.translation() = Eigen::Vector3d(0, 0, 1);
  cloud.depth_m.assign(cloud.width * cloud.height, static_cast<float>(distance_m));
  return cloud;
}

Points patch_at(double distance_m) {
  Points points;
  for (int i = -2; i <= 2; ++i)
    points.emplace_back(static_cast<float>(distance_m), 0.1f * static_cast<float>(i), 1.0f);
  return points;
}

TEST(ViewMemory, SaysWhatWasSeenThroughAndSinceWhen) {
  ViewMemory memory;
  EXPECT_EQ(memory.seen_empty_share(patch_at(1.5), 100 * kSecond, 3.0, 0.1), 0.0);
  memory.add(wall_at(2.5), 10 * kSecond);
  EXPECT_EQ(memory.seen_empty_share(patch_at(1.5), 100 * kSecond, 3.0, 0.1), 1.0);
  EXPECT_EQ(memory.seen_empty_share(patch_at(2.45), 100 * kSecond, 3.0, 0.1), 0.0)
      << "the wall itself";
  EXPECT_EQ(memory.seen_empty_share(patch_at(2.8), 100 * kSecond, 3.0, 0.1), 0.0) << "behind it";
  EXPECT_EQ(memory.seen_empty_share(patch_at(1.5), 10 * kSecond, 3.0, 0.1), 0.0)
      << "not before it was looked at";
}

TEST(ViewMemory, PixelsWithoutReturnProveNothing) {
  ViewMemory memory;
  memory.add(wall_at(0.0), kSecond);
  EXPECT_EQ(memory.seen_empty_share(patch_at(1.5), 100 * kSecond, 3.0, 0.1), 0.0);
}

TEST(ViewMemory, SomethingNearInATileHidesAllOfIt) {
  ViewMemory memory;
  OrganizedCloud cloud = wall_at(2.5);
  // One pixel in each tile of 8 x 8.
  for (int row = 3; row < cloud.height; row += 8) {
    for (int col = 3; col < cloud.width; col += 8) cloud.depth_m[row * cloud.width + col] = 1.0f;
  }
  memory.add(cloud, kSecond);
  EXPECT_EQ(memory.seen_empty_share(patch_at(1.5), 100 * kSecond, 3.0, 0.1), 0.0);
}

TEST(ViewMemory, KeepsAnOldViewBesideTheLatestOfAPlace) {
  ViewMemory memory;
  memory.add(wall_at(2.5), 1 * kSecond);
  for (int i = 0; i < 300; ++i) memory.add(wall_at(1.0), (20 + i) * kSecond);
  EXPECT_EQ(memory.size(), 2u) << "memory follows the ground, not time";
  memory = ViewMemory();
  memory.add(wall_at(2.5), 1 * kSecond);
  memory.add(wall_at(1.0), 2 * kSecond);
  EXPECT_EQ(memory.size(), 1u) << "too soon";
  memory.add(wall_at(1.0), 20 * kSecond);
  EXPECT_EQ(memory.seen_empty_share(patch_at(1.5), 100 * kSecond, 3.0, 0.1), 1.0)
      << "it was empty once, before the box came";
}

}  // namespace
}  // namespace pocd
