// What happens to the map when the world changes: carving, clearing, change of owner.
#include <gtest/gtest.h>

#include <map>

#include "map_fixtures.hpp"
#include "pocd/map/map_edits.hpp"
#include "pocd/map/mesh.hpp"

namespace pocd::testing {
namespace {

constexpr int kFree = 29490;  // stored distance from which a voxel is free space

std::size_t count_owned(const TsdfMap& map, std::uint32_t owner) {
  std::size_t count = 0;
  for (const BlockKey& key : map.sorted_keys()) {
    for (const std::uint32_t o : map.find(key)->owner) count += o == owner;
  }
  return count;
}

// Surface voxels (observed, not free) nearer than y.
int surface_before(const TsdfMap& map, double y_m) {
  int count = 0;
  for (const BlockKey& key : map.sorted_keys()) {
    const VoxelBlock& block = *map.find(key);
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      count += block.weight[v] > 0 && block.tsdf[v] < kFree &&
               voxel_center(key, v, map.config().voxel_size_m).y() < y_m;
    }
  }
  return count;
}

TEST(TsdfChange, VanishedWallIsCarvedInAFewFramesEvenAtFullWeight) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());  // weight cap 100
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  for (int i = 0; i < 120; ++i) map.integrate(look({1.5, {}}, pose).input(), pool);
  ASSERT_GT(surface_before(map, 1.8), 1000);
  map.take_dirty();
  // The weight is halved by each contradiction: log2(100) + 1 = 7 frames empty a voxel.
  for (int i = 0; i < 7; ++i) map.integrate(look({3.0, {}}, pose).input(), pool);
  EXPECT_EQ(surface_before(map, 1.65), 0);
  const std::vector<BlockKey> dirty = map.take_dirty();
  int dropped = 0;
  for (const BlockKey& key : dirty) dropped += map.find(key) == nullptr;
  EXPECT_GT(dropped, 0);  // blocks that hold free space only are gone, and announced
}

TEST(TsdfChange, OneWrongFrameErasesNothing) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  for (int i = 0; i < 120; ++i) map.integrate(look({1.5, {}}, pose).input(), pool);
  const Mesh before = extract_mesh(map, 2, pool);
  map.integrate(look({3.0, {}}, pose).input(), pool);
  const Mesh after = extract_mesh(map, 2, pool);
  // Not a triangle is lost, and the surface moves by one part in 51 of the truncation at most: 4
  // mm.
  double moved = 0.0;
  std::size_t kept = 0;
  for (const Eigen::Vector3f& p : after.vertices_W) {
    if (p.y() > 2.0f) continue;
    moved = std::max(moved, std::abs(p.y() - 1.5));
    ++kept;
  }
  EXPECT_GE(kept, before.vertices_W.size());
  EXPECT_LT(moved, 0.0045);
}

TEST(TsdfChange, MissingDepthErasesNothing) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  View view = look({1.5, {}}, camera_pose({0, 0, 1}, 0, 0));
  map.integrate(view.input(), pool);
  const int before = surface_before(map, 2.0);
  view.frame.depth_m.setTo(0.0);
  for (int i = 0; i < 20; ++i) map.integrate(view.input(), pool);
  view.frame.depth_m.setTo(std::numeric_limits<float>::quiet_NaN());
  for (int i = 0; i < 20; ++i) map.integrate(view.input(), pool);
  EXPECT_EQ(surface_before(map, 2.0), before);
}

// A thin bar two pixels wide before a wall, seen with a pose that wavers by half a pixel (3 mm at
// 1 m): the rays just beside it must not eat it.
TEST(TsdfChange, ThinThingsSurviveSmallPoseErrors) {
  ThreadPool pool(1);
  TsdfConfig config = coarse_config();
  config.voxel_size_m = 0.01;
  TsdfMap map(config);
  Random random(3);
  std::size_t owned_early = 0;
  for (int i = 0; i < 60; ++i) {
    const Pose pose = camera_pose({0, 0, 1}, 0, 0);
    View view = look({2.5, {}}, pose);
    const int left = random.uniform() < 0.5 ? 80 : 81;
    for (int v = 0; v < 120; ++v) {
      for (int u = left; u < left + 3; ++u) {
        view.frame.depth_m.at<float>(v, u) = 1.0f;
        view.owners[v * 160 + u] = 5;
      }
    }
    map.integrate(view.input(), pool);
    if (i == 9) owned_early = count_owned(map, 5);
  }
  ASSERT_GT(owned_early, 0u);
  EXPECT_GE(count_owned(map, 5), owned_early * 9 / 10);
}

// Free space has a small weight, so that a thing put there appears within about as many frames.
TEST(TsdfChange, NewThingAppearsInSpaceKnownToBeFree) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  for (int i = 0; i < 120; ++i) map.integrate(look({2.5, {}}, pose).input(), pool);
  const Scene with_ball{2.5, {{{0.0, 1.5, 1.0}, 0.4, 6}}};
  for (int i = 0; i < 4; ++i) map.integrate(look(with_ball, pose).input(), pool);
  const Mesh mesh = extract_mesh(map, 2, pool);
  int ball = 0;
  for (const Eigen::Vector3f& p : mesh.vertices_W) ball += p.y() < 1.5f;
  EXPECT_GT(ball, 100);
}

// Behind its front, within the truncation, the map takes a thing to be solid; behind that may be
// free space from before. That back belongs to it, so that it goes with it.
TEST(TsdfChange, NewThingInFreeSpaceOwnsItsBack) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  // Free space is kept where surfaces are near.
  const Sphere behind{{0.0, 1.9, 1.0}, 0.3, 5}, thing{{0.0, 1.4, 1.0}, 0.2, 6};
  for (int i = 0; i < 20; ++i) map.integrate(look({2.5, {behind}}, pose).input(), pool);
  for (int i = 0; i < 20; ++i) map.integrate(look({2.5, {behind, thing}}, pose).input(), pool);
  const auto before_the_other = [&] {
    int own = 0, other = 0;
    const Mesh mesh = extract_mesh(map, 2, pool);
    for (std::size_t i = 0; i < mesh.vertices_W.size(); ++i) {
      const Eigen::Vector3f p = mesh.vertices_W[i] - Eigen::Vector3f(0.0f, 0.0f, 1.0f);
      if (p.y() < 1.5f && std::hypot(p.x(), p.z()) < 0.12f) ++(mesh.owner[i] == 6 ? own : other);
    }
    return std::make_pair(own, other);
  };
  EXPECT_GT(before_the_other().first, 20);
  EXPECT_EQ(before_the_other().second, 0);
  map.clear_object(ObjectId{6});
  EXPECT_EQ(before_the_other(), std::make_pair(0, 0));
}

// A surface that lies farther or nearer than the map says, by less than the truncation, is not
// contradicted by free space: it has to follow all the same, from full weight.
TEST(TsdfChange, AShiftedSurfaceFollowsWithinAFewFrames) {
  ThreadPool pool(1);
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  for (const double shift_m : {-0.15, 0.15}) {
    TsdfMap map(coarse_config());
    for (int i = 0; i < 120; ++i) map.integrate(look({1.5, {}}, pose).input(), pool);
    for (int i = 0; i < 20; ++i) map.integrate(look({1.5 + shift_m, {}}, pose).input(), pool);
    const Mesh mesh = extract_mesh(map, 2, pool);
    int at_new = 0, before_new = 0;
    for (const Eigen::Vector3f& p : mesh.vertices_W) {
      if (std::abs(p.x()) > 0.4f || std::abs(p.z() - 1.0f) > 0.3f) continue;
      at_new += std::abs(p.y() - 1.5 - shift_m) < 0.035;
      before_new += p.y() < 1.5 + shift_m - 0.035;
    }
    // Averaging at full weight would leave it within a centimetre of the old place.
    EXPECT_GT(at_new, 16 * 12 - 60) << shift_m << ": one per voxel";
    EXPECT_EQ(before_new, 0) << shift_m << ": nothing is left where the camera sees through";
  }
}

// What was seen to be free stays so behind a thin thing that comes to stand before it.
TEST(TsdfChange, KnownFreeSpaceStaysFreeBehindASurface) {
  ThreadPool pool(1);
  const Pose front = camera_pose({0, 0, 1}, 0, 0);
  const Sphere near_it{{0.45, 1.75, 1.0}, 0.2, 5};  // free space is kept where surfaces are near
  for (const int looks : {1, 10}) {
    TsdfMap map(coarse_config());
    for (int i = 0; i < looks; ++i) map.integrate(look({2.5, {near_it}}, front).input(), pool);
    const Eigen::Vector3f behind(0.1f, 1.62f, 1.0f);
    ASSERT_TRUE(map.distance_at(behind, std::min(looks, 8)));
    ASSERT_GT(*map.distance_at(behind, 1), 0.15);
    // A thin thing at 1.5 m: the place is 2.4 voxels behind its face.
    for (int i = 0; i < 10; ++i) map.integrate(look({1.5, {}}, front).input(), pool);
    const auto distance_m = map.distance_at(behind, 1);
    ASSERT_TRUE(distance_m);
    EXPECT_EQ(*distance_m > 0.15, looks >= 3) << "one look does not make it known";
  }
}

TEST(TsdfChange, DistanceIsThatOfTheVoxelOnceItWasSeenOftenEnough) {
  ThreadPool pool(1);
  TsdfMap map(coarse_config());
  const Pose pose = camera_pose({0, 0, 1}, 0, 0);
  EXPECT_FALSE(map.distance_at({0.0f, 1.4f, 1.0f}, 1));
  for (int i = 0; i < 5; ++i) map.integrate(look({1.5, {}}, pose).input(), pool);
  for (const float y : {1.36f, 1.42f, 1.47f, 1.52f, 1.58f}) {
    const auto distance_m = map.distance_at({0.02f, y, 1.02f}, 5);
    ASSERT_TRUE(distance_m) << y;
    EXPECT_NEAR(*distance_m, 1.5 - y, 0.026) << "half a voxel";
    EXPECT_FALSE(map.distance_at({0.02f, y, 1.02f}, 6)) << "five looks";
  }
  EXPECT_FALSE(map.distance_at({0.0f, 2.4f, 1.0f}, 1)) << "behind all";
  EXPECT_TRUE(map.distance_at({-0.02f, 1.42f, 1.02f}, 1)) << "left of the origin";
}

class ClearObject : public ::testing::Test {
 protected:
  void SetUp() override {
    const Scene scene{2.5, {{{-0.4, 1.5, 1.0}, 0.3, 3}, {{0.3, 1.4, 0.9}, 0.25, 9}}};
    for (const Pose& pose : arc_of_poses(20, 2)) map.integrate(look(scene, pose).input(), pool);
    ASSERT_GT(count_owned(map, 3), 100u);
    ASSERT_GT(count_owned(map, 9), 100u);
    map.take_dirty();
  }
  ThreadPool pool{1};
  TsdfMap map{coarse_config()};
};

TEST_F(ClearObject, ResetsExactlyTheOwnersVoxels) {
  std::map<BlockKey, VoxelBlock> before;
  for (const BlockKey& key : map.sorted_keys()) before[key] = *map.find(key);
  const std::size_t owned = count_owned(map, 3);
  EXPECT_EQ(map.clear_object(ObjectId{3}), owned);
  std::vector<BlockKey> touched;
  for (const auto& [key, old] : before) {
    const VoxelBlock* now = map.find(key);
    bool had_owner = false, surface = false;
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      const bool cleared = old.owner[v] == 3;
      had_owner |= cleared;
      surface |= !cleared && old.weight[v] > 0 && old.tsdf[v] < kFree;
      if (!now) continue;
      EXPECT_EQ(now->weight[v], cleared ? 0 : old.weight[v]);
      EXPECT_EQ(now->owner[v], cleared ? 0u : old.owner[v]);
      EXPECT_EQ(now->tsdf[v], cleared ? 0 : old.tsdf[v]);
    }
    if (had_owner) touched.push_back(key);
    EXPECT_EQ(now == nullptr, had_owner && !surface);  // only emptied blocks are dropped
  }
  EXPECT_EQ(map.take_dirty(), touched);
  EXPECT_EQ(map.clear_object(ObjectId{3}), 0u);
  EXPECT_EQ(map.clear_object(ObjectId{77}), 0u);
}

TEST_F(ClearObject, WhereOnlyWhatIsInsideIsReset) {
  const auto left_half = [](const Eigen::Vector3d& center_W) { return center_W.x() < -0.4; };
  std::map<BlockKey, VoxelBlock> before;
  for (const BlockKey& key : map.sorted_keys()) before[key] = *map.find(key);
  const std::size_t owned = count_owned(map, 3), others = count_owned(map, 9);
  const std::size_t cleared = map.clear_object_where(ObjectId{3}, left_half);
  EXPECT_GT(cleared, owned / 4);
  EXPECT_LT(cleared, 3 * owned / 4);
  EXPECT_EQ(count_owned(map, 3), owned - cleared);
  EXPECT_EQ(count_owned(map, 9), others);
  for (const auto& [key, old] : before) {
    const VoxelBlock* now = map.find(key);
    if (!now) continue;
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      const bool gone = old.owner[v] == 3 && left_half(voxel_center(key, v, 0.05));
      EXPECT_EQ(now->weight[v], gone ? 0 : old.weight[v]);
      EXPECT_EQ(now->owner[v], gone ? 0u : old.owner[v]);
    }
  }
  EXPECT_FALSE(map.take_dirty().empty());
  // The rest is found again.
  EXPECT_EQ(map.clear_object_where(ObjectId{3}, left_half), 0u);
  EXPECT_TRUE(map.take_dirty().empty()) << "nothing changed";
  EXPECT_EQ(map.clear_object(ObjectId{3}), owned - cleared);
  EXPECT_EQ(map.clear_object_where(ObjectId::kNone, left_half), 0u);
}

TEST_F(ClearObject, ReassignedVoxelsBelongToTheOther) {
  const std::size_t three = count_owned(map, 3), nine = count_owned(map, 9);
  EXPECT_EQ(map.reassign_object(ObjectId{3}, ObjectId{9}), three);
  EXPECT_EQ(count_owned(map, 3), 0u);
  EXPECT_EQ(map.reassign_object(ObjectId{9}, ObjectId{9}), 0u);
  EXPECT_EQ(map.clear_object(ObjectId{9}), three + nine);
}

TEST_F(ClearObject, EditsAreMadeInTheirOrderAndOnce) {
  const auto left_half = [](const Eigen::Vector3d& center_W) { return center_W.x() < -0.4; };
  const std::size_t three = count_owned(map, 3), nine = count_owned(map, 9);
  MapEdits edits;
  edits.clear(ObjectId{3}, left_half);
  edits.reassign(ObjectId{3}, ObjectId{5});
  edits.reassign(ObjectId{9}, ObjectId{3});
  EXPECT_EQ(count_owned(map, 3), three) << "noted only";
  // What is asked of the map meanwhile knows of the edits.
  int asked = 0;
  for (const BlockKey& key : map.sorted_keys()) {
    const VoxelBlock block = *map.find(key);
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      if (block.weight[v] == 0) continue;
      const Eigen::Vector3d at = voxel_center(key, v, 0.05);
      EXPECT_EQ(map.distance_at(at.cast<float>(), 1, edits).has_value(),
                !(block.owner[v] == 3 && left_half(at)));
      ++asked;
    }
  }
  EXPECT_GT(asked, 1000);
  edits.apply_to(map);
  const std::size_t rest = count_owned(map, 5);
  EXPECT_GT(rest, three / 4);
  EXPECT_LT(rest, 3 * three / 4);
  EXPECT_EQ(count_owned(map, 3), nine) << "what came later under its number is another thing's";
  EXPECT_EQ(count_owned(map, 9), 0u);
  edits.apply_to(map);
  EXPECT_EQ(count_owned(map, 3), nine);
  edits.clear(ObjectId{3});
  edits.apply_to(map);
  EXPECT_EQ(count_owned(map, 3), 0u);
  EXPECT_EQ(count_owned(map, 5), rest);
}

TEST_F(ClearObject, OwnersWrittenByHandAreFound) {
  VoxelBlock& block = map.touch({50, 50, 50});
  block.weight[7] = 4;
  block.owner[7] = 21;
  block.weight[8] = 4;
  block.owner[8] = 22;
  EXPECT_EQ(map.clear_object(ObjectId{21}), 1u);
  ASSERT_NE(map.find({50, 50, 50}), nullptr);
  EXPECT_EQ(map.clear_object(ObjectId{22}), 1u);
  EXPECT_EQ(map.find({50, 50, 50}), nullptr);
}

TEST_F(ClearObject, SurfaceSeenAsBackgroundLosesItsOwner) {
  // Within a voxel of the surface, where the mesh gets its owners; a quarter of the truncation. On
  // the side that is seen; the back, from the outline on, stays whose it was.
  const auto at_surface = [this] {
    std::size_t count = 0;
    for (const BlockKey& key : map.sorted_keys()) {
      const VoxelBlock& block = *map.find(key);
      for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
        count += block.owner[v] == 3 && std::abs(block.tsdf[v]) < 32767 / 4 &&
                 voxel_center(key, v, 0.05).y() < 1.4;
      }
    }
    return count;
  };
  const Scene unowned{2.5, {{{-0.4, 1.5, 1.0}, 0.3, 0}, {{0.3, 1.4, 0.9}, 0.25, 9}}};
  ASSERT_GT(at_surface(), 100u);
  for (const Pose& pose : arc_of_poses(20, 2)) map.integrate(look(unowned, pose).input(), pool);
  EXPECT_EQ(at_surface(), 0u);
}

}  // namespace
}  // namespace pocd::testing
