// What counts as a look, how looks follow each other, and what they say of the whole thing.
#include <optional>

#include "tracker_rig.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::room_with;
using test::solid;
using test::TrackerRig;

const Eigen::Vector3d kSize(0.8, 0.4, 0.8);
const SceneObject kBox = solid(kBoxClass, {0.0, 2.0}, kSize);
constexpr double kHour_s = 3600.0;

TEST(Looks, AThingInPiecesIsSeenOncePerFrame) {
  const std::uint32_t needed = static_cast<std::uint32_t>(StateConfig().confirm_observations);
  ASSERT_GE(needed, 3u);
  TrackerRig rig;
  rig.look(room_with({kBox}));
  for (std::uint32_t looks = 2; looks <= needed; ++looks) {
    std::size_t pieces = 0;
    rig.look(room_with({kBox}), [&](test::Segmented& s) {
      test::cut(s, kBoxClass, -0.15f);
      test::cut(s, kBoxClass, 0.15f);
      pieces = s.observations.list.size();
    });
    ASSERT_EQ(pieces, 3u);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
    EXPECT_EQ(rig.of_class(kBoxClass)[0]->observations, looks);
    EXPECT_EQ(rig.of_class(kBoxClass)[0]->confirmed, looks == needed) << looks;
    for (const Surfel& surfel : rig.of_class(kBoxClass)[0]->model.surfels())
      ASSERT_LE(surfel.hits, looks);
  }
}

// When it was last in its place is what tells a like thing that came before it went from it.
TEST(Looks, AThingOfFewPointsIsFoundInItsPlaceToo) {
  TrackerRig rig;
  rig.look_times(12, room_with({solid(kBoxClass, {0.0, 1.6}, {0.14, 0.14, 0.16})}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const LibraryObject& small = *rig.of_class(kBoxClass)[0];
  ASSERT_TRUE(small.confirmed) << rig.told();
  ASSERT_LT(small.model.surfels().size(), 30u);
  EXPECT_GT(small.in_place_ns, small.first_seen_ns);
  EXPECT_EQ(small.in_place_ns, small.last_seen_ns);
}

// At the edge of view a post of a shelf is seen once or twice on each visit.
TEST(Looks, OfWhatHasNoClassThoseOfOneVisitCount) {
  const int needed = StateConfig().confirm_observations;
  for (const bool has_class : {true, false}) {
    TrackerRig rig;
    const auto edit = [&](test::Segmented& s) {
      for (Observation& o : s.observations.list) {
        if (o.class_id == kBoxClass && !has_class) o.class_id = kThing;
      }
    };
    const auto visit = [&](int looks) {
      rig.look(room_with({kBox}), edit, 60.0);
      rig.look_times(looks - 1, room_with({kBox}), edit);
    };
    for (int visits = 0; visits < 3; ++visits) visit(needed - 1);
    EXPECT_EQ(rig.count(EventKind::kAdded), has_class ? 1u : 0u) << rig.told();
    visit(needed);
    EXPECT_EQ(rig.count(EventKind::kAdded), 1u) << rig.told();
  }
}

/// Two boxes that touch: one piece in the image, unless masks or the view tell them apart.
class Companions : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto two = [](test::Segmented& s) { test::cut(s, kBoxClass, 0.0f, 1, 2); };
    rig_.look_times(8, scene_, two);
    ASSERT_EQ(boxes(), 2u) << rig_.told();
  }
  void as_one(int looks) { rig_.look_times(looks, scene_); }
  void as_two(int looks) {
    rig_.look_times(looks, scene_, [](test::Segmented& s) { test::cut(s, kBoxClass, 0.0f); });
  }
  std::size_t boxes() const { return rig_.of_class(kBoxClass).size(); }

  const int enough_ = StateConfig().merge_frames;
  const Scene scene_ = room_with({solid(kBoxClass, {-0.25, 2.0}, {0.5, 0.4, 0.8}),
                                  solid(kBoxClass, {0.25, 2.0}, {0.5, 0.4, 0.8})});
  TrackerRig rig_;
};

TEST_F(Companions, SeenAsOneForLongEnoughAreOne) {
  as_one(enough_ - 1);
  EXPECT_EQ(boxes(), 2u) << rig_.told();
  as_one(1);
  EXPECT_EQ(boxes(), 1u) << rig_.told();
}

// A cluster in some far frames, ever, is no reason to join them for good.
TEST_F(Companions, SeenAsTwoTheyHaveToBeSeenAsOneForAsLongAgain) {
  for (int visit = 0; visit < 3; ++visit) {
    as_one(enough_ - 1);
    as_two(enough_ - 1);
  }
  as_one(enough_ - 1);
  EXPECT_EQ(boxes(), 2u) << rig_.told();
  as_one(1);
  EXPECT_EQ(boxes(), 1u) << rig_.told();
}

/// Two walls that meet in a corner, seen from within.
class Corner : public ::testing::Test {
 protected:
  const SceneObject far_ = solid(kBoxClass, {0.15, 2.6}, {0.7, 0.05, 0.8});
  const SceneObject side_ = solid(kBoxClass, {0.525, 2.0}, {0.05, 1.2, 0.8});
  const Scene both_ = room_with({far_, side_});
  TrackerRig rig_;
};

TEST_F(Corner, WallsAreNotJoinedHoweverLongTheyAreOnePiece) {
  rig_.look_times(8, both_, [](test::Segmented& s) { test::cut(s, kBoxClass, 0.48f, 1, 2); });
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 2u) << rig_.told();
  rig_.look_times(3 * StateConfig().merge_frames, both_);
  EXPECT_EQ(rig_.of_class(kBoxClass).size(), 2u) << rig_.told();
}

TEST_F(Corner, AWallThatWasNotSeenStandsWhenTheOtherOneIsGone) {
  rig_.look_times(10, both_);
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << rig_.told();
  const ObjectId id = rig_.of_class(kBoxClass)[0]->id;
  // Next time the other wall is out of view, to the right.
  rig_.eye = test::look_from({-0.5, 1.0, 1.0});
  rig_.look(room_with({side_}), {}, 60.0);
  rig_.look_times(14, room_with({side_}));
  ASSERT_EQ(rig_.count(EventKind::kRemoved), 1u) << rig_.told();
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << rig_.told();
  const LibraryObject& rest = *rig_.of_class(kBoxClass)[0];
  EXPECT_EQ(rest.id, id);
  EXPECT_NEAR(rest.box.pose.position_W.x(), 0.5, 0.06);
  EXPECT_NEAR(longest_side(rest.box), 1.2, 0.25);
}

// The near wall lies before the far one, but the far one does not lie before the near one.
TEST_F(Corner, TheNearWallOfAContainerThatIsGoneDoesNotStand) {
  const Scene container = room_with({solid(kBoxClass, {0.0, 1.8}, {1.0, 0.05, 0.6}),
                                     solid(kBoxClass, {0.0, 2.4}, {1.0, 0.05, 0.9}),
                                     solid(kBoxClass, {-0.475, 2.1}, {0.05, 0.6, 0.6}),
                                     solid(kBoxClass, {0.475, 2.1}, {0.05, 0.6, 0.6})});
  rig_.look_times(10, container);
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << rig_.told();
  // Next time the near wall is out of view, below.
  rig_.eye = test::look_from({0.0, 1.3, 1.0});
  rig_.look(room_with({}), {}, 60.0);
  rig_.look_times(14, room_with({}));
  EXPECT_EQ(rig_.count(EventKind::kRemoved), 1u) << rig_.told();
  EXPECT_EQ(rig_.of_class(kBoxClass).size(), 0u) << rig_.told();
}

/// A box that is there, and two doubtful frames at the end of a visit.
class InARow : public ::testing::Test {
 protected:
  void know(const PipelineConfig& config = test::room_config(),
            const Scene& scene = room_with({kBox})) {
    rig_.emplace(config);
    rig_->look_times(30, scene);
    ASSERT_EQ(rig_->of_class(kBoxClass).size(), 1u);
  }
  const LibraryObject& box() const { return *rig_->of_class(kBoxClass).at(0); }

  const Scene gone_ = room_with({});
  const Scene there_ = room_with({kBox});
  std::optional<TrackerRig> rig_;
};

TEST_F(InARow, LooksThatFindAThingGoneAnHourApartAreNotInARow) {
  know();
  rig_->look_times(2, gone_);
  ASSERT_EQ(box().looks_unobserved, 2);
  rig_->look(gone_, {}, kHour_s);
  EXPECT_EQ(rig_->count(EventKind::kRemoved), 0u) << rig_->told();
  EXPECT_EQ(box().looks_unobserved, 1);
  rig_->look(gone_);
  EXPECT_EQ(rig_->count(EventKind::kRemoved), 0u) << rig_->told();
  rig_->look(gone_);
  EXPECT_EQ(rig_->count(EventKind::kRemoved), 1u) << rig_->told();
  EXPECT_GT(rig_->events.back().first_gone_ns, static_cast<StampNs>(kHour_s * 1e9));
}

TEST_F(InARow, LooksThatFindAThingDisplacedAnHourApartAreNotInARow) {
  const Eigen::Vector3d small(0.6, 0.4, 0.6);
  const Scene pushed = room_with({solid(kBoxClass, {-0.4, 2.1}, small)});
  know(test::room_config(), room_with({solid(kBoxClass, {-0.4, 2.3}, small)}));
  rig_->look_times(2, pushed);
  ASSERT_EQ(box().looks_displaced, 2);
  rig_->look(pushed, {}, kHour_s);
  EXPECT_EQ(box().looks_displaced, 1);
  EXPECT_EQ(rig_->count(EventKind::kMoved), 0u) << rig_->told();
  rig_->look_times(2, pushed);
  EXPECT_EQ(rig_->count(EventKind::kMoved), 1u) << rig_->told();
}

TEST_F(InARow, TwoDoubtfulFramesAnHourApartDropNoCandidate) {
  PipelineConfig config = test::room_config();
  config.state.confirm_observations = 1000;
  config.state.max_count = 100.0;  // its belief alone would drop it
  know(config);
  ASSERT_FALSE(box().confirmed);
  const ObjectId id = box().id;
  rig_->look(gone_);
  ASSERT_EQ(box().looks_unobserved, 1);
  rig_->look(gone_, {}, kHour_s);
  rig_->look(there_);
  ASSERT_EQ(rig_->of_class(kBoxClass).size(), 1u);
  EXPECT_EQ(box().id, id);
  rig_->look_times(2, gone_);
  EXPECT_TRUE(rig_->of_class(kBoxClass).empty()) << "two in a row do";
}

// Every look of a camera that sends a picture now and then is a visit of its own.
TEST_F(InARow, ASlowCameraFindsAThingGoneInAsManyLooks) {
  const double slow_s = 4.0 * StateConfig().visit_gap_s;
  TrackerRig rig;
  rig.look_times(10, there_, {}, slow_s);
  ASSERT_EQ(rig.count(EventKind::kAdded), 1u) << rig.told();
  rig.look_times(3, gone_, {}, slow_s);
  EXPECT_EQ(rig.count(EventKind::kRemoved), 1u) << rig.told();
}

// A camera at 90 Hz: three frames within a thirtieth of a second are alike, and so are their
// errors.
TEST(Looks, ThreeFramesOfOneMomentAreNotThreeLooks) {
  constexpr double kPeriod_s = 1.0 / 90.0;
  const Scene before = room_with({kBox});
  for (const bool carried_off : {false, true}) {
    const Scene after =
        carried_off ? room_with({}) : room_with({solid(kBoxClass, {0.0, 1.8}, kSize)});
    const EventKind kind = carried_off ? EventKind::kRemoved : EventKind::kMoved;
    TrackerRig rig;
    rig.look_times(60, before, {}, kPeriod_s);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u);
    const auto id = rig.of_class(kBoxClass)[0]->id;
    rig.look_times(8, after, {}, kPeriod_s);
    EXPECT_EQ(rig.count(kind), 0u) << rig.told();
    rig.look_times(30, before, {}, kPeriod_s);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
    EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, id);
    EXPECT_EQ(rig.count(EventKind::kRemoved) + rig.count(EventKind::kMoved), 0u) << rig.told();
    // When it lasts it is told: a camera that stands sees a thing that was moved.
    rig.look_times(20, after, {}, kPeriod_s);
    EXPECT_EQ(rig.count(kind), 1u) << rig.told();
  }
}

// Of its first look only the end is known, which stands where nobody had looked before.
TEST(Looks, ArrivalIsJudgedOfTheWholeThing) {
  constexpr int kUnknownFrom = 220;  // columns of the image
  const auto one = [](test::Segmented& s) {
    for (Observation& observation : s.observations.list) observation.instance = 1;
  };
  TrackerRig rig;
  rig.holes = [](Frame& frame) { frame.depth_m.colRange(kUnknownFrom, 320).setTo(0.0f); };
  rig.look_times(10, room_with({}));
  rig.holes = [](Frame& frame) { frame.depth_m.colRange(0, kUnknownFrom).setTo(0.0f); };
  const Scene scene = room_with({solid(kBoxClass, {0.2, 2.0}, {1.2, 0.4, 0.8})});
  rig.look(scene, one);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u);
  ASSERT_EQ(rig.of_class(kBoxClass)[0]->arrival, Arrival::kFound) << "all that is known of it yet";
  rig.holes = {};
  rig.look_times(10, scene, one);
  ASSERT_EQ(rig.count(EventKind::kAdded), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass).size(), 1u);
  EXPECT_EQ(rig.events[0].arrival, Arrival::kArrived);
}

// A mask named something for one frame where the next ones show background.
TEST(Looks, ACandidateThatIsNotMeasuredIsForgotten) {
  TrackerRig rig;
  rig.look(room_with({kBox}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u);
  const auto without = [](test::Segmented& s) {
    s.observations.list.clear();
    s.observations.observation_of.assign(s.cloud.size(), Observations::kNone);
  };
  const int frames = StateConfig().tentative_frames;
  rig.look_times(frames, room_with({kBox}), without);
  EXPECT_EQ(rig.of_class(kBoxClass).size(), 1u);
  rig.look(room_with({kBox}), without);
  EXPECT_TRUE(rig.of_class(kBoxClass).empty());
}

/// A box behind a screen, of which a strip at the side was seen once.
class HiddenCandidate : public ::testing::Test {
 protected:
  void SetUp() override {
    rig_.holes = [](Frame& frame) { frame.depth_m.colRange(0, 150).setTo(0.0f); };
    rig_.look(room_with({kBox}));
    rig_.holes = {};
    ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u);
  }
  void hide(int looks, double period_s) { rig_.look_times(looks, screened_, {}, period_s); }

  const Scene screened_ = room_with({kBox, solid(kCageClass, {0.0, 1.2}, {1.6, 0.1, 1.5})});
  TrackerRig rig_;
};

TEST_F(HiddenCandidate, LapsesAtLastAndItsSurfaceStays) {
  const auto surface = [&](std::uint32_t owner) {
    int count = 0;
    for (const BlockKey& key : rig_.map().sorted_keys()) {
      const VoxelBlock& block = *rig_.map().find(key);
      for (int i = 0; i < VoxelBlock::kVoxels; ++i)
        count += block.weight[i] > 0 && block.tsdf[i] <= 0 && block.owner[i] == owner;
    }
    return count;
  };
  const auto candidate = to_index(rig_.of_class(kBoxClass)[0]->id);
  const int known = surface(candidate);
  ASSERT_GT(known, 10);
  const double window_s = StateConfig().relocation_window_s;
  hide(20, 0.5 * window_s / 20);
  ASSERT_EQ(rig_.of_class(kBoxClass).size(), 1u) << "it may be seen soon";
  ASSERT_EQ(surface(candidate), known);
  const int of_nobody = surface(0);
  hide(20, 0.6 * window_s / 20);
  EXPECT_TRUE(rig_.of_class(kBoxClass).empty());
  EXPECT_EQ(surface(candidate), 0);
  EXPECT_NEAR(surface(0), of_nobody + known, 0.1 * known)
      << "nobody has seen that nothing is there";
  EXPECT_EQ(rig_.count(EventKind::kRemoved), 0u) << "nobody was told of it";
}

}  // namespace
}  // namespace pocd
