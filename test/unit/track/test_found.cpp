// Things of which only a part was seen at first: what they are parts of, and where they went.
#include "tracker_rig.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::kPersonClass;
using test::room_with;
using test::solid;
using test::TrackerRig;

// A screen hides the right half of a bench. Its end is seen first, from the right.
TEST(Found, WhatGrewOntoAKnownThingIsASideOfIt) {
  const SceneObject bench = solid(kBoxClass, {0.0, 2.4}, {1.8, 0.3, 1.3});
  const SceneObject screen = solid(kCageClass, {0.4, 1.6}, {0.9, 0.1, 1.6});
  PipelineConfig config = test::room_config();
  config.state.merge_frames = 1000;  // it is not joined for being one piece for long
  TrackerRig rig(config);
  rig.look_times(10, room_with({bench, screen}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const ObjectId known = rig.of_class(kBoxClass)[0]->id;
  rig.eye = test::look_from({1.5, 1.2, 1.0});
  rig.look(room_with({bench}), {}, 60.0);
  rig.look_times(8, room_with({bench}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
  // Then the middle, from above to below.
  rig.eye = test::look_from({0.5, 0.6, 1.0});
  rig.look(room_with({bench, solid(kCageClass, {0.4, 1.6}, {0.9, 0.1, 0.7})}));
  rig.look_times(3, room_with({bench}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, known);
}

// As a robot passes it: its middle is seen last, on the same visit or on the next one.
TEST(Found, AThingOfWhichOneEndAndThenTheOtherWasSeenIsOne) {
  const Scene scene = room_with({solid(kBoxClass, {0.0, 2.4}, {1.8, 0.3, 0.8})});
  for (const double away_s : {0.1, 60.0}) {
    TrackerRig rig;
    rig.eye = test::look_from({-1.0, 1.2, 1.0});
    rig.look_times(8, scene);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
    ASSERT_LT(longest_side(rig.of_class(kBoxClass)[0]->box), 0.8);
    const ObjectId id = rig.of_class(kBoxClass)[0]->id;
    rig.eye = test::look_from({1.0, 1.2, 1.0});
    rig.look(scene, {}, away_s);
    rig.look_times(8, scene);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
    rig.eye = test::look_from({0.0, 0.3, 1.0});
    rig.look(scene, {}, away_s);
    rig.look_times(2 * StateConfig().merge_frames, scene);
    ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
    EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, id);
    EXPECT_NEAR(longest_side(rig.of_class(kBoxClass)[0]->box), 1.8, 0.1);
    EXPECT_EQ(rig.count(EventKind::kRemoved) + rig.count(EventKind::kMoved), 0u) << rig.told();
  }
}

// A post hides what is between them, and one visit showed the left one, another the right one.
TEST(Found, ThingsWhoseFacesAreInOnePlaneAreNoSidesOfOneThing) {
  const Eigen::Vector3d size(0.8, 0.4, 1.3);
  const auto screen = [](double x, double width) {
    return solid(kCageClass, {x, 1.6}, {width, 0.1, 1.6});
  };
  const SceneObject left = solid(kBoxClass, {-0.5, 2.3}, size);
  const SceneObject right = solid(kBoxClass, {0.5, 2.3}, size);
  TrackerRig rig;
  const auto visit = [&](const SceneObject& before, int looks) {
    const Scene scene = room_with({left, right, before});
    rig.look(scene, {}, 60.0);
    rig.look_times(looks, scene);
  };
  visit(screen(0.42, 1.0), 10);
  visit(screen(-0.42, 1.0), 10);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
  // On each visit it is asked once which of the known things are one.
  visit(screen(0.0, 0.24), 3);
  EXPECT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
}

// A candidate may wait for long until it is reported: who reads the events knows the other one.
TEST(Found, OfTwoPiecesTheOneReportedFirstGoesOn) {
  const Scene scene = room_with({solid(kBoxClass, {0.0, 2.4}, {1.8, 0.3, 0.8})});
  TrackerRig rig;
  rig.eye = test::look_from({-1.0, 1.2, 1.0});
  rig.look(scene);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const ObjectId candidate = rig.of_class(kBoxClass)[0]->id;
  rig.eye = test::look_from({1.0, 1.2, 1.0});
  rig.look_times(8, scene);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
  const ObjectId reported = rig.of_class(kBoxClass)[1]->id;
  ASSERT_EQ(rig.confirmed(), std::set<ObjectId>{reported});
  rig.eye = test::look_from({-1.0, 1.2, 1.0});
  rig.look_times(8, scene);
  ASSERT_EQ(rig.confirmed(), (std::set<ObjectId>{candidate, reported})) << rig.told();
  rig.eye = test::look_from({0.0, 0.3, 1.0});
  rig.look_times(2 * StateConfig().merge_frames, scene);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, reported) << rig.told();
}

// From below, the top of a cart is not seen, and its mast is no neighbour of its sides.
TEST(Found, WhatACartCarriesIsOfIt) {
  const Scene scene = room_with({solid(kBoxClass, {-0.4, 2.5}, {0.9, 0.9, 0.6}),
                                 solid(kBoxClass, {-0.4, 2.55}, {0.12, 0.12, 1.3})});
  TrackerRig rig;
  rig.eye = test::look_from({0.6, 0.7, 0.45}, 0.3, 0.0);
  rig.look_times(10, scene);
  EXPECT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  ASSERT_EQ(rig.confirmed().size(), 1u) << rig.told();
  EXPECT_NEAR(rig.of_class(kBoxClass)[0]->box.size_m.z(), 1.3, 0.15);
}

// A low screen hides where a fork is fixed to its truck, a tall one the fork itself at first.
TEST(Found, AForkBeforeItsTruckIsAPieceOfIt) {
  const SceneObject truck = solid(kBoxClass, {0.0, 2.85}, {0.8, 0.5, 1.0});
  const SceneObject fork = solid(kBoxClass, {0.0, 2.1}, {0.3, 0.5, 0.2});
  const SceneObject low = solid(kCageClass, {0.0, 2.42}, {1.2, 0.1, 0.3});
  TrackerRig rig;
  rig.look_times(10, room_with({truck, fork, low, solid(kCageClass, {0.0, 1.7}, {1.2, 0.1, 0.5})}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const ObjectId known = rig.of_class(kBoxClass)[0]->id;
  const Scene seen = room_with({truck, fork, low});
  rig.look(seen, {}, 60.0);
  rig.look_times(10, seen);
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, known);
  EXPECT_NE(rig.of_class(kBoxClass)[0]->model.nearest({0.0f, 2.1f, 0.2f}, 0.1f),
            ObjectModel::kNone);
}

// Of what left, a screen hid nearly the half: what came is larger than what was known.
TEST(Found, AThingOfWhichOnlyAPartWasKnownMovesAsAWhole) {
  const Eigen::Vector3d size(0.9, 0.3, 0.7);
  const SceneObject screen = solid(kCageClass, {-0.12, 1.6}, {0.33, 0.1, 1.6});
  TrackerRig rig;
  rig.look_times(10, room_with({solid(kBoxClass, {-0.5, 2.3}, size), screen}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const LibraryObject& known = *rig.of_class(kBoxClass)[0];
  ASSERT_LT(longest_side(known.box), 0.65);
  const ObjectId id = known.id;
  const Scene after = room_with({solid(kBoxClass, {0.6, 2.3}, size), screen});
  rig.look(after, {}, 60.0);
  rig.look_times(40, after);
  EXPECT_EQ(rig.count(EventKind::kMoved), 1u) << rig.told();
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, id);
}

// A pole before it shows it in two pieces. Of the place of one of them, most was hidden before.
TEST(Found, WhatIsJoinedWithAPartThatArrivedHasArrived) {
  const SceneObject pole = solid(kPersonClass, {0.25, 1.6}, {0.19, 0.05, 1.6});
  const SceneObject box = solid(kBoxClass, {0.325, 2.25}, {0.65, 0.3, 0.8});
  TrackerRig rig;
  rig.look_times(20, room_with({solid(kPersonClass, {0.04, 1.6}, {0.09, 0.05, 1.6}), pole}));
  rig.look(room_with({box, pole}), {}, 60.0);
  rig.look_times(10, room_with({box, pole}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 2u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->arrival, Arrival::kUnknown);
  EXPECT_EQ(rig.of_class(kBoxClass)[1]->arrival, Arrival::kArrived);
  rig.look_times(20, room_with({box}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->arrival, Arrival::kArrived);
}

// Of four times its length, behind what hid the place: nobody saw that it was empty before.
TEST(Found, AThingThatMovedFarToAHiddenPlaceHasMoved) {
  const Eigen::Vector3d size(0.3, 0.3, 0.5);
  const SceneObject screen = solid(kCageClass, {0.6, 1.8}, {0.6, 0.05, 1.4});
  TrackerRig rig;
  rig.look_times(10, room_with({solid(kBoxClass, {-0.6, 2.2}, size), screen}));
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  const ObjectId known = rig.of_class(kBoxClass)[0]->id;
  const Scene after = room_with({solid(kBoxClass, {0.6, 2.2}, size)});
  rig.look(after, {}, 60.0);
  rig.look_times(40, after);
  EXPECT_EQ(rig.count(EventKind::kMoved), 1u) << rig.told();
  ASSERT_EQ(rig.of_class(kBoxClass).size(), 1u) << rig.told();
  EXPECT_EQ(rig.of_class(kBoxClass)[0]->id, known);
}

}  // namespace
}  // namespace pocd
