// What holds in every frame of every drive: an act is no larger than its evidence.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "drive.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::room_with;
using test::solid;

using Blocks = std::map<BlockKey, VoxelBlock>;

Blocks blocks_of(const TsdfMap& map) {
  Blocks blocks;
  for (const BlockKey& key : map.sorted_keys()) blocks.emplace(key, *map.find(key));
  return blocks;
}

struct Cleared {
  int voxels = 0;     ///< surface that was lost in one frame
  int of_others = 0;  ///< of these: of an object that no event of the frame is about
  int measured = 0;   ///< of these: where the frame measured a surface
};

/// Compares the map before and after a frame. Fusion never takes more than three quarters of a
/// voxel's weight in one frame: a voxel that was well known and is not any more was cleared.
Cleared cleared_by(const Frame& frame, const FrameResult& result, const Blocks& before,
                   const TsdfMap& map) {
  constexpr int kKnown = 8, kNearSurface = 16384;
  const double voxel_m = map.config().voxel_size_m;
  std::set<std::uint32_t> acted;
  for (const ObjectEvent& e : result.events) {
    acted.insert(to_index(e.object));
    if (e.absorbed) acted.insert(to_index(*e.absorbed));
  }
  for (const ObjectId id : result.retired) acted.insert(to_index(id));
  const Pose T_C_W = frame.T_W_C.inverse();
  Cleared cleared;
  for (const auto& [key, old] : before) {
    const VoxelBlock* now = map.find(key);
    for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
      if (old.weight[v] < kKnown || std::abs(old.tsdf[v]) > kNearSurface) continue;
      if (now && now->weight[v] > 1) continue;
      ++cleared.voxels;
      cleared.of_others += old.owner[v] != 0 && acted.count(old.owner[v]) == 0;
      const Eigen::Vector3d p =
          T_C_W * (Eigen::Vector3d(8 * key.x + (v & 7) + 0.5, 8 * key.y + (v >> 3 & 7) + 0.5,
                                   8 * key.z + (v >> 6) + 0.5) *
                   voxel_m);
      if (p.z() < 0.2) continue;
      const auto u = std::lround(frame.camera.fx * p.x() / p.z() + frame.camera.cx);
      const auto w = std::lround(frame.camera.fy * p.y() / p.z() + frame.camera.cy);
      if (u < 1 || w < 1 || u >= frame.camera.width - 1 || w >= frame.camera.height - 1) continue;
      // All around, so that neither the grid's stride nor the refined pose matters.
      bool measured = true;
      for (int n = 0; n < 9; ++n) {
        const float depth = frame.depth_m.at<float>(static_cast<int>(w) + n / 3 - 1,
                                                    static_cast<int>(u) + n % 3 - 1);
        measured &= std::abs(depth - p.z()) < 0.75 * voxel_m;
      }
      cleared.measured += measured;
    }
  }
  return cleared;
}

/// What each known piece of surface was last seen to be, by looks of the camera alone.
class Witness {
 public:
  /// Takes in a frame, with the map before it.
  void look(const Frame& frame, const Blocks& before, double voxel_m) {
    ++frame_;
    const Pose T_C_W = frame.T_W_C.inverse();
    for (const auto& [key, block] : before) {
      for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
        if (block.weight[v] < kKnown || std::abs(block.tsdf[v]) > kNearSurface) continue;
        Seen& seen = seen_[{key, v}];
        const Eigen::Vector3d p = T_C_W * centre(key, v, voxel_m);
        if (p.z() < 0.2) continue;
        const auto u = std::lround(frame.camera.fx * p.x() / p.z() + frame.camera.cx);
        const auto w = std::lround(frame.camera.fy * p.y() / p.z() + frame.camera.cy);
        if (u < 2 || w < 2 || u >= frame.camera.width - 2 || w >= frame.camera.height - 2) continue;
        bool measured = true;
        for (int n = 0; n < 9; ++n) {
          const float depth = frame.depth_m.at<float>(static_cast<int>(w) + 2 * (n / 3) - 2,
                                                      static_cast<int>(u) + 2 * (n % 3) - 2);
          measured &= depth > 0.0f && std::abs(depth - p.z()) < 1.5 * voxel_m;
        }
        // At an outline either may be right.
        const float middle = frame.depth_m.at<float>(static_cast<int>(w), static_cast<int>(u));
        const bool through = middle > p.z() + 1.5 * voxel_m;
        if (measured) seen.measured = frame_;
        if (through) seen.through = frame_;
      }
    }
  }
  /// Of the surface that was lost in this frame: what was measured within the last looks and not
  /// seen through since; and pieces of which nothing was measured once and seen through since. A
  /// piece's parts are no farther apart than a thing is thick.
  std::pair<int, int> standing_and_untouched(const Blocks& before, const TsdfMap& map,
                                             double thick_m) const {
    const double voxel_m = map.config().voxel_size_m;
    std::vector<Eigen::Vector3d> gone, unseen;
    int standing = 0;
    for (const auto& [key, old] : before) {
      const VoxelBlock* now = map.find(key);
      for (int v = 0; v < VoxelBlock::kVoxels; ++v) {
        if (old.weight[v] < kKnown || std::abs(old.tsdf[v]) > kNearSurface) continue;
        if (now && now->weight[v] > 1) continue;
        const auto at = seen_.find({key, v});
        const Seen seen = at == seen_.end() ? Seen() : at->second;
        if (seen.through > 0 && seen.through >= seen.measured) {
          // Voxels at an outline were never measured all around: they tell nothing of a thing.
          if (seen.measured > 0) gone.push_back(centre(key, v, voxel_m));
        } else {
          standing += seen.measured > 0 && frame_ - seen.measured < kLately;
          unseen.push_back(centre(key, v, voxel_m));
        }
      }
    }
    const auto untouched = std::count_if(unseen.begin(), unseen.end(), [&](const auto& p) {
      return std::none_of(gone.begin(), gone.end(),
                          [&](const auto& q) { return (p - q).norm() < thick_m; });
    });
    return {standing, static_cast<int>(untouched)};
  }

 private:
  /// A quarter of the truncation: before a surface that stands, nothing farther is seen through.
  static constexpr int kKnown = 8, kNearSurface = 8192, kLately = 3;
  static Eigen::Vector3d centre(const BlockKey& key, int v, double voxel_m) {
    return Eigen::Vector3d(8 * key.x + (v & 7) + 0.5, 8 * key.y + (v >> 3 & 7) + 0.5,
                           8 * key.z + (v >> 6) + 0.5) *
           voxel_m;
  }
  struct Seen {
    int measured = 0, through = 0;  ///< last frame; 0: never
  };
  std::map<std::pair<BlockKey, int>, Seen> seen_;
  int frame_ = 0;
};

struct Totals {
  int removed = 0, moved = 0, cleared = 0;
};

/// No thing of the room is larger from end to end.
constexpr double kThick_m = 1.2;

/// One frame of a drive with all that must hold after it.
void expect_within_evidence(PocdPipeline& pipeline, const Frame& frame, Totals& totals,
                            Witness* witness = nullptr) {
  const Blocks before = blocks_of(pipeline.map());
  if (witness) witness->look(frame, before, pipeline.map().config().voxel_size_m);
  const FrameResult result = pipeline.process_frame(frame);
  const Cleared cleared = cleared_by(frame, result, before, pipeline.map());
  totals.cleared += cleared.voxels;
  const std::string where =
      "frame " + std::to_string(frame.sequence) + "\n" + test::text(result.events);
  EXPECT_EQ(cleared.of_others, 0) << where;
  std::set<ObjectId> there;
  for (const ObjectSnapshot& o : pipeline.objects()) there.insert(o.id);
  bool realigned = false;
  for (const ObjectEvent& e : result.events) {
    if (e.kind == EventKind::kUpdated || e.kind == EventKind::kAdded) continue;
    ++(e.kind == EventKind::kMoved ? totals.moved : totals.removed);
    EXPECT_EQ(there.count(e.object), e.kind == EventKind::kMoved ? 1u : 0u) << where;
    // A thing that was pushed is measured at its new place; any other one left a place that was
    // seen through.
    if (e.evidence.rule == "aligned_elsewhere") {
      realigned = true;
      EXPECT_GT(e.evidence.visible_share, 0.0) << where;
    } else {
      EXPECT_GT(e.evidence.seen_through_share, 0.0) << where;
      EXPECT_GT(e.evidence.measurement_sigma_m, 0.0) << where;
    }
  }
  // A pushed thing takes all of its voxels with it.
  if (!realigned) {
    EXPECT_EQ(cleared.measured, 0) << where;
    if (witness && cleared.voxels > 0) {
      const auto [standing, untouched] =
          witness->standing_and_untouched(before, pipeline.map(), kThick_m);
      EXPECT_EQ(standing, 0) << "of " << cleared.voxels << " in " << where;
      EXPECT_EQ(untouched, 0) << "of " << cleared.voxels << " in " << where;
    }
  }
  // Nobody owns voxels who is not known, but for candidates, which have ids of their own.
  for (const ObjectId id : result.retired) {
    for (const BlockKey& key : pipeline.map().sorted_keys()) {
      const auto& owner = pipeline.map().find(key)->owner;
      EXPECT_EQ(std::count(owner.begin(), owner.end(), to_index(id)), 0) << where;
    }
  }
}

TEST(Invariants, AnActIsNoLargerThanItsEvidenceInTheHall) {
  Totals totals;
  for (const char* name : {"shifted.yaml", "swapped.yaml"}) {
    Scenario scenario = load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim" / name);
    CameraModel& camera = scenario.camera;
    camera = {camera.width / 2, camera.height / 2, camera.fx / 2,
              camera.fy / 2,    camera.cx / 2,     camera.cy / 2};
    scenario.frame_rate_hz /= 2;
    SimReaderOptions options;
    options.with_color = false;
    SimReader reader(scenario, options);
    PipelineConfig config;
    config.classes = test::room_classes();
    config.segmentation.stride = 1;
    PocdPipeline pipeline(config);
    while (const auto frame = reader.next()) expect_within_evidence(pipeline, *frame, totals);
  }
  EXPECT_GE(totals.removed, 1);
  EXPECT_GE(totals.moved, 1);
  EXPECT_GT(totals.cleared, 500);
}

TEST(Invariants, AnActIsNoLargerThanItsEvidenceInTheRoom) {
  Totals totals;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const PipelineConfig config = test::room_config();
    test::Drive drive(config);
    Witness witness;
    std::vector<SceneObject> things;
    for (int k = 0; k < 3; ++k) {
      things.push_back(
          solid(random.below(2) ? kBoxClass : kCageClass,
                {-0.8 + 0.8 * k + random.uniform(-0.1, 0.1), random.uniform(2.0, 2.7)},
                {random.uniform(0.25, 0.5), random.uniform(0.25, 0.5), random.uniform(0.4, 1.0)},
                random.uniform(-0.8, 0.8)));
    }
    const auto watch = [&](int frames) {
      for (int i = 0; i < frames; ++i) {
        Frame frame = drive.next_frame(room_with(things));
        expect_within_evidence(drive.pipeline(), frame, totals, &witness);
      }
    };
    watch(20);
    // One is carried off, one is pushed; then the carried one comes back elsewhere.
    const SceneObject carried = things.back();
    things.pop_back();
    things[0].T_W_O.pretranslate(Eigen::Vector3d(0.2, -0.25, 0.0));
    watch(20);
    things.push_back(carried);
    things.back().T_W_O.pretranslate(Eigen::Vector3d(-0.1, -0.6, 0.0));
    watch(20);
  }
  EXPECT_GE(totals.removed, 3);
  EXPECT_GE(totals.moved, 6);
  EXPECT_GT(totals.cleared, 500);
}

// The robot passes a long thing. While it stands before one end, that end is carried off: the other
// one, which is out of view, stands.
TEST(Invariants, AnActIsNoLargerThanItsEvidenceOfALongThing) {
  const PipelineConfig config = test::room_config();
  PocdPipeline pipeline(config);
  Witness witness;
  Totals totals;
  std::uint64_t count = 0;
  const auto watch = [&](const Scene& scene, double x_m) {
    Frame frame = test::shoot(scene, test::look_from({x_m, 0.3, 1.0}), count++);
    test::add_noise(frame, config.depth_noise, 17);
    expect_within_evidence(pipeline, frame, totals, &witness);
  };
  const Scene before = room_with({solid(kBoxClass, {0.0, 2.2}, {2.8, 0.3, 0.7})});
  const Scene after = room_with({solid(kBoxClass, {-0.55, 2.2}, {1.7, 0.3, 0.7})});
  constexpr int kPass = 20;  // frames from end to end
  constexpr double kEnd_m = 0.9;
  for (int i = 0; i <= 3 * kPass; ++i) watch(before, -kEnd_m * std::cos(M_PI * i / kPass));
  for (int i = 0; i < 12; ++i) watch(after, kEnd_m);
  for (int i = 0; i <= kPass; ++i) watch(after, kEnd_m * std::cos(M_PI * i / kPass));
  EXPECT_EQ(totals.removed, 1);
  EXPECT_EQ(totals.moved, 0);
  EXPECT_GT(totals.cleared, 100);
  ASSERT_EQ(pipeline.objects().size(), 1u);
  EXPECT_NEAR(pipeline.objects()[0].box.pose.position_W.x(), -0.55, 0.1);
}

// Noise, wandering poses and holes in the depth: nothing changed, and nothing is said to have.
TEST(Invariants, AStillSceneHasNoRemovalsAndNoMoves) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(40 + seed);
    std::vector<SceneObject> things;
    for (int k = 0; k < 4; ++k) {
      things.push_back(
          solid(random.below(2) ? kBoxClass : kCageClass,
                {-0.9 + 0.6 * k + random.uniform(-0.1, 0.1), random.uniform(1.8, 2.9)},
                {random.uniform(0.2, 0.5), random.uniform(0.2, 0.5), random.uniform(0.3, 1.1)},
                random.uniform(-0.8, 0.8)));
    }
    const Scene scene = room_with(things);
    const PipelineConfig config = test::room_config();
    PocdPipeline pipeline(config);
    std::vector<ObjectEvent> events;
    const double fast = random.uniform(0.7, 1.5);
    for (std::uint64_t i = 0; i < 80; ++i) {
      Frame frame = test::shoot(scene, test::swaying_camera(i), i);
      test::add_noise(frame, config.depth_noise, seed);
      const double t = 0.1 * fast * static_cast<double>(i);
      frame.T_W_C.pretranslate(
          Eigen::Vector3d(0.02 * std::sin(t), 0.02 * std::cos(1.3 * t), 0.005 * std::sin(0.7 * t)));
      frame.T_W_C.rotate(Eigen::AngleAxisd(0.005 * std::sin(0.9 * t), Eigen::Vector3d::UnitY()));
      for (int hole = 0; hole < 6; ++hole) {
        const cv::Rect at(static_cast<int>(random.below(280)), static_cast<int>(random.below(200)),
                          static_cast<int>(5 + random.below(36)),
                          static_cast<int>(5 + random.below(36)));
        frame.depth_m(at).setTo(0.0f);
      }
      const FrameResult result = pipeline.process_frame(frame);
      events.insert(events.end(), result.events.begin(), result.events.end());
    }
    int added = 0;
    for (const ObjectEvent& e : events) {
      added += e.kind == EventKind::kAdded;
      EXPECT_NE(e.kind, EventKind::kRemoved) << "seed " << seed << "\n" << test::text(events);
      EXPECT_NE(e.kind, EventKind::kMoved) << "seed " << seed << "\n" << test::text(events);
    }
    EXPECT_GE(added, 3) << "seed " << seed << "\n" << test::text(events);
  }
}

}  // namespace
}  // namespace pocd
