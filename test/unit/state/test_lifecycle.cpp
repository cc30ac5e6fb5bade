#include "pocd/state/lifecycle.hpp"

#include <gtest/gtest.h>

#include "pocd/common/random.hpp"
#include "pocd/state/bayesian_update.hpp"

namespace pocd {
namespace {

const StateConfig kState;
const ChangeConfig kChange;

LibraryObject known_object(int stationarity_class = 0) {
  LibraryObject object(ObjectId{1}, 0.05);
  object.confirmed = true;
  object.stationarity_class = stationarity_class;
  object.observations = 10;
  object.belief = {0.0, 0.1, 8.0, 2.0};
  std::vector<SurfacePoint> points;
  for (int i = 0; i < 100; ++i) {
    points.push_back({{0.05f * static_cast<float>(i % 10) + 0.02f,
                       0.05f * static_cast<float>(i / 10) + 0.02f, 0.02f},
                      {0, 0, 1},
                      0.01f});
  }
  object.model.fuse(points);
  object.most_surfels = object.model.surfels().size();
  return object;
}

OrientedBox box_of(double x, double y, const Eigen::Vector3d& size_m) {
  OrientedBox box;
  box.pose.position_W = {x, y, 0.5 * size_m.z()};
  box.size_m = size_m;
  return box;
}

Belief random_belief(Random& random) {
  const double count = std::exp(random.uniform(std::log(0.2), std::log(kState.max_count)));
  const double mean = random.uniform(0.02, 0.98);
  return {random.uniform(-0.3, 0.3), std::exp(random.uniform(std::log(0.1), std::log(1.0))),
          mean * count, (1 - mean) * count};
}

TEST(ApplyMeasurement, EvidenceAloneGivesTheBeliefAfterIt) {
  Random random(51);
  for (int i = 0; i < 2000; ++i) {
    LibraryObject object = known_object(static_cast<int>(random.below(2)));
    object.belief = random_belief(random);
    const double delta_m = random.uniform(-1.2, 1.2) * kChange.delta_max_m * (i % 2 ? 1.0 : 0.05);
    const double sigma_m = random.uniform(0.1, 0.4);
    const Evidence e = apply_measurement(object, delta_m, sigma_m, {}, kState, kChange);
    const Belief again = next_belief(
        e.before, {e.delta_m, e.stationarity_class, e.measurement_sigma_m, e.k}, kState, kChange);
    ASSERT_EQ(e.measurement_sigma_m, sigma_m);
    ASSERT_EQ(again.mu, e.after.mu);
    ASSERT_EQ(again.sigma, e.after.sigma);
    ASSERT_EQ(again.alpha, e.after.alpha);
    ASSERT_EQ(again.beta, e.after.beta);
    ASSERT_EQ(object.belief.alpha, e.after.alpha) << "the object has it";
    ASSERT_NEAR(e.c1 + e.c2, 1.0, 1e-12);
    ASSERT_LE(std::abs(e.delta_m), kChange.delta_max_m);
  }
}

TEST(ApplyMeasurement, EvidenceSaysHowMuchWasSeen) {
  Sighting s;
  s.total = 100;
  s.hit = 30;
  s.seen_through = 10;
  LibraryObject object = known_object(1);
  const Evidence e = apply_measurement(object, 0.01, 0.23, s, kState, kChange);
  EXPECT_EQ(e.visible_share, 0.4);
  EXPECT_EQ(e.seen_through_share, 0.25);
  EXPECT_EQ(e.stationarity_class, 1);
  EXPECT_EQ(e.measurement_sigma_m, 0.23);
  EXPECT_TRUE(e.rule.empty());
}

TEST(ApplyMeasurement, KFollowsClassAndKind) {
  for (const int s : {0, 1}) {
    for (const double delta_m : {0.0, kChange.delta_max_m}) {
      LibraryObject object = known_object(s);
      const bool inlier = delta_m == 0.0;
      EXPECT_EQ(apply_measurement(object, delta_m, kChange.tau_m, {}, kState, kChange).k,
                inlier == (s == 1) ? kState.k : 0.0);
    }
  }
}

TEST(NextBelief, IsTheBayesianStepWithItsBounds) {
  Random random(52);
  int bounded = 0;
  for (int i = 0; i < 2000; ++i) {
    const Belief before = random_belief(random);
    const int s = static_cast<int>(random.below(2));
    const double k = random.below(2) ? kState.k : 0.0;
    const double delta_m = random.uniform(-0.3, 0.3);
    const Belief plain =
        bayesian_update(before, {delta_m, s, kChange.tau_m, k}, kChange.delta_max_m).belief;
    const Belief after = next_belief(before, {delta_m, s, kChange.tau_m, k}, kState, kChange);
    ASSERT_LE(after.alpha + after.beta, kState.max_count * (1 + 1e-12));
    ASSERT_GE(after.sigma, kState.min_sigma_share * kChange.tau_m);
    ASSERT_NEAR(after.stationarity(), plain.stationarity(), 1e-12) << "the cap keeps E[v]";
    ASSERT_EQ(after.mu, plain.mu);
    bounded += after.alpha + after.beta < plain.alpha + plain.beta;
  }
  EXPECT_GT(bounded, 50);
}

TEST(NextBelief, UpdateAboveVMaxIsNotApplied) {
  StateConfig state;
  state.max_stationarity = 0.9;
  const Belief before{0.02, 0.15, 8.9, 1.1};
  const Belief after = next_belief(before, {0.0, 1, kChange.tau_m, 3.0}, state, kChange);
  EXPECT_EQ(after.alpha, before.alpha);
  EXPECT_EQ(after.beta, before.beta);
  EXPECT_EQ(after.mu, before.mu);
  EXPECT_EQ(after.sigma, before.sigma);
  // What lowers it is applied from there all the same.
  EXPECT_LT(next_belief(before, {kChange.delta_max_m, 0, kChange.tau_m, 3.0}, state, kChange)
                .stationarity(),
            before.stationarity());
}

TEST(Boxes, HideWhatLiesBehindThem) {
  const OrientedBox box = box_of(2.0, 0.0, {0.4, 1.0, 1.0});
  const double z = box.pose.position_W.z();
  const Eigen::Vector3d eye_W(0.0, 0.0, z);
  EXPECT_TRUE(hides(box, eye_W, {4.0, 0.0, z}));
  EXPECT_TRUE(hides(box, eye_W, {2.0, 0.0, z})) << "within";
  EXPECT_FALSE(hides(box, eye_W, {1.5, 0.0, z})) << "before it";
  EXPECT_FALSE(hides(box, eye_W, {4.0, 2.0, z})) << "beside it";
  EXPECT_FALSE(hides(box, eye_W, {4.0, 0.0, z + 2.0})) << "above it";
  EXPECT_FALSE(hides(box, eye_W, {-4.0, 0.0, z})) << "behind the eye";
  OrientedBox turned = box;
  turned.pose.yaw_rad = 0.5 * M_PI;
  EXPECT_TRUE(hides(box, eye_W, {4.0, 0.8, z}));
  EXPECT_FALSE(hides(turned, eye_W, {4.0, 0.8, z})) << "its end is narrow";
}

TEST(RemovalRule, NoneForAHealthyObject) {
  EXPECT_FALSE(removal_rule(known_object(), kState, kChange));
}

TEST(RemovalRule, StationarityBelowThreshold) {
  LibraryObject object = known_object();
  object.belief.alpha = kState.remove_below * 10 - 1e-9;
  object.belief.beta = 10 - object.belief.alpha;
  EXPECT_EQ(removal_rule(object, kState, kChange), "stationarity_below_threshold");
  object.belief.alpha = kState.remove_below * 10 + 1e-9;
  object.belief.beta = 10 - object.belief.alpha;
  EXPECT_FALSE(removal_rule(object, kState, kChange));
}

TEST(RemovalRule, ChangeEstablished) {
  LibraryObject object = known_object();
  object.belief.mu = -kChange.tau_m;
  object.belief.sigma = 0.5 * kChange.tau_m;
  EXPECT_EQ(removal_rule(object, kState, kChange), "change_established")
      << "the sign does not matter";
  object.belief.sigma = 1.1 * kChange.tau_m;
  EXPECT_FALSE(removal_rule(object, kState, kChange)) << "not sure enough";
  object.belief.sigma = 0.1 * kChange.tau_m;
  object.belief.mu = 0.5 * kChange.tau_m;
  EXPECT_FALSE(removal_rule(object, kState, kChange)) << "a change that verifies the object";
}

TEST(RemovalRule, NothingLeft) {
  LibraryObject object = known_object();
  for (std::size_t i = 0; i < 95; ++i) object.model.surfels()[i].seen_through = 5;
  object.model.erode(5);
  EXPECT_EQ(removal_rule(object, kState, kChange), "nothing_left");
  object = known_object();
  for (std::size_t i = 0; i < 50; ++i) object.model.surfels()[i].seen_through = 5;
  object.model.erode(5);
  EXPECT_FALSE(removal_rule(object, kState, kChange)) << "half a thing is a thing";
}

TEST(RemovalRule, CandidatesGoEarly) {
  LibraryObject object = known_object();
  object.confirmed = false;
  EXPECT_FALSE(removal_rule(object, kState, kChange));
  object.frames_seen_through = 2;
  EXPECT_EQ(removal_rule(object, kState, kChange), "candidate_seen_through");
  object.frames_seen_through = 0;
  object.frames_in_view = kState.tentative_frames + 1;
  EXPECT_EQ(removal_rule(object, kState, kChange), "never_confirmed");
  object.confirmed = true;
  object.frames_seen_through = 2;
  EXPECT_FALSE(removal_rule(object, kState, kChange)) << "these are rules for candidates alone";
}

TEST(Alike, SizesWithinAThirdWhicheverWayTheyLie) {
  const OrientedBox a = box_of(0, 0, {1.0, 0.5, 0.8});
  EXPECT_TRUE(alike(a, a, 0.0));
  EXPECT_TRUE(alike(a, box_of(9, 9, {0.5, 1.0, 0.8}), 0.0)) << "turned by a quarter, elsewhere";
  EXPECT_TRUE(alike(a, box_of(0, 0, {0.7, 0.5, 0.8}), 0.0));
  EXPECT_FALSE(alike(a, box_of(0, 0, {0.6, 0.5, 0.8}), 0.0));
  EXPECT_FALSE(alike(a, box_of(0, 0, {1.0, 0.5, 0.4}), 0.0)) << "height counts for itself";
  EXPECT_TRUE(alike(a, box_of(0, 0, {1.0, 0.5, 0.4}), 0.45)) << "within the slack";
  EXPECT_FALSE(alike(box_of(0, 0, {1, 1, 2}), box_of(0, 0, {2, 1, 1}), 0.0))
      << "lying is not standing";
}

TEST(FitsInside, PartsOfAnySizeButNothingLarger) {
  const OrientedBox whole = box_of(0, 0, {1.0, 0.5, 0.8});
  EXPECT_TRUE(fits_inside(box_of(0, 0, {0.3, 0.02, 0.4}), whole, 0.0));
  EXPECT_TRUE(fits_inside(box_of(0, 0, {0.5, 1.1, 0.9}), whole, 0.0)) << "within 20 %";
  EXPECT_FALSE(fits_inside(box_of(0, 0, {1.3, 0.5, 0.8}), whole, 0.0));
  EXPECT_FALSE(fits_inside(box_of(0, 0, {0.3, 0.3, 1.2}), whole, 0.0));
  EXPECT_TRUE(fits_inside(box_of(0, 0, {0.3, 0.3, 1.2}), whole, 0.5));
}

TEST(SameSide, OneFaceOfTheWhole) {
  const OrientedBox whole = box_of(0, 0, {1.0, 0.5, 0.8});
  EXPECT_TRUE(same_side(box_of(0, 0, {0.02, 1.0, 0.8}), whole, 0.0)) << "its long side";
  EXPECT_TRUE(same_side(box_of(0, 0, {0.5, 0.02, 0.8}), whole, 0.0)) << "its end";
  EXPECT_FALSE(same_side(box_of(0, 0, {0.75, 0.02, 0.8}), whole, 0.0)) << "neither";
  EXPECT_FALSE(same_side(box_of(0, 0, {1.0, 0.02, 0.4}), whole, 0.0)) << "half as high";
}

TEST(Filled, ThinBoxesGrowAwayFromTheEye) {
  const OrientedBox face = box_of(2.0, 0.0, {0.02, 1.0, 0.8});
  const OrientedBox from_left = filled(face, {0, 0, 1}, 0.4);
  EXPECT_NEAR(from_left.size_m.x(), 0.4, 1e-12);
  EXPECT_NEAR(from_left.size_m.y(), 1.0, 1e-12);
  // The near side stays at 1.99.
  EXPECT_NEAR(from_left.pose.position_W.x() - 0.2, 1.99, 1e-12);
  const OrientedBox from_right = filled(face, {5, 0, 1}, 0.4);
  EXPECT_NEAR(from_right.pose.position_W.x() + 0.2, 2.01, 1e-12);
}

TEST(CompletedBox, PartOfAMovedThingIsPlacedWholeWithTheLeastMotion) {
  const OrientedBox known = box_of(0.0, 3.0, {2.0, 0.5, 1.0});
  const Eigen::Vector3d eye_W(0, 0, 0.5);
  // Its left third is seen 0.4 m farther away; nothing says that it slid.
  OrientedBox whole = completed_box(box_of(-0.7, 3.2, {0.6, 0.04, 1.0}), known, eye_W, 0.4);
  EXPECT_NEAR(whole.pose.position_W.x(), 0.0, 1e-12);
  EXPECT_NEAR(whole.pose.position_W.y(), 3.18 + 0.25, 1e-12) << "behind the face that is seen";
  EXPECT_TRUE(whole.size_m.isApprox(Eigen::Vector3d(2.0, 0.5, 1.0)));
  // A part that sticks out by 0.3 m: it slid by at least that.
  whole = completed_box(box_of(1.0, 2.77, {0.6, 0.04, 1.0}), known, eye_W, 0.4);
  EXPECT_NEAR(whole.pose.position_W.x(), 0.3, 1e-12);
}

TEST(RelocationMemory, HoldsWhatWasRemovedWithinTheWindow) {
  constexpr StampNs kSecond = 1'000'000'000;
  RelocationMemory memory;
  for (std::uint32_t id : {1u, 2u}) {
    RelocationMemory::Removed removed{};
    removed.id = ObjectId{id};
    removed.removed_ns = (id == 1 ? 100 : 150) * kSecond;
    memory.remember(removed);
  }
  EXPECT_EQ(memory.recent(160 * kSecond, 60.0).size(), 2u) << "at the window's end";
  ASSERT_EQ(memory.recent(161 * kSecond, 60.0).size(), 1u);
  EXPECT_EQ(memory.recent(161 * kSecond, 60.0)[0].id, ObjectId{2});
  memory.forget(ObjectId{2});
  EXPECT_TRUE(memory.recent(161 * kSecond, 60.0).empty());
}

}  // namespace
}  // namespace pocd
