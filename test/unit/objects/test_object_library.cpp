#include "pocd/objects/object_library.hpp"

#include <gtest/gtest.h>

#include <set>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

OrientedBox box_at(double x, double y, const Eigen::Vector3d& size_m = {0.5, 0.5, 1.0},
                   double yaw_rad = 0.0) {
  OrientedBox box;
  box.pose.position_W = {x, y, 0.5};
  box.pose.yaw_rad = yaw_rad;
  box.size_m = size_m;
  return box;
}

/// Distance of a place to the nearest point of a box, seen from above.
double distance_to(const OrientedBox& box, const Eigen::Vector3d& place_W) {
  const Eigen::Vector2d d = (place_W - box.pose.position_W).head<2>();
  const Eigen::Vector2d in_box = Eigen::Rotation2Dd(-box.pose.yaw_rad) * d;
  return (in_box.cwiseAbs() - 0.5 * box.size_m.head<2>()).cwiseMax(0.0).norm();
}

TEST(ObjectLibrary, IdsAreNewAndNeverUsedTwice) {
  ObjectLibrary library;
  std::set<ObjectId> seen;
  for (int i = 0; i < 20; ++i) {
    const ObjectId id = library.create(0.05).id;
    EXPECT_NE(id, ObjectId::kNone);
    EXPECT_TRUE(seen.insert(id).second);
    if (i % 3 == 0) library.erase(id);
  }
  EXPECT_EQ(library.size(), 13u);
}

TEST(ObjectLibrary, AReservedIdIsNobodyElses) {
  ObjectLibrary library;
  std::set<ObjectId> seen;
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(seen.insert(library.create(0.05).id).second);
    const ObjectId reserved = library.reserve_id();
    EXPECT_NE(reserved, ObjectId::kNone);
    EXPECT_TRUE(seen.insert(reserved).second);
    EXPECT_EQ(library.find(reserved), nullptr) << "nothing has it yet";
  }
  EXPECT_EQ(library.size(), 10u);
  // What left as a part and is found again takes that id.
  const ObjectId part = library.reserve_id();
  LibraryObject& found = library.create(0.05);
  library.rename(found.id, part);
  EXPECT_EQ(library.find(part), &found);
}

TEST(ObjectLibrary, ArrivalsHaveNames) {
  EXPECT_STREQ(to_string(Arrival::kUnknown), "unknown");
  EXPECT_STREQ(to_string(Arrival::kFound), "found");
  EXPECT_STREQ(to_string(Arrival::kArrived), "arrived");
  EXPECT_EQ(LibraryObject(ObjectId{1}, 0.05).arrival, Arrival::kUnknown);
}

TEST(ObjectLibrary, FindsWhatItHolds) {
  ObjectLibrary library;
  LibraryObject& object = library.create(0.05);
  EXPECT_EQ(library.find(object.id), &object);
  EXPECT_EQ(object.model.spacing_m(), 0.05);
  const ObjectId id = object.id;
  library.erase(id);
  EXPECT_EQ(library.find(id), nullptr);
  EXPECT_EQ(library.find(ObjectId{77}), nullptr);
}

TEST(ObjectLibrary, NearMissesNothingAndIsNotFarOff) {
  Random random(41);
  ObjectLibrary library;
  std::vector<ObjectId> ids;
  const auto random_box = [&] {
    return box_at(random.uniform(-20, 20), random.uniform(-20, 20),
                  {random.uniform(0.1, 6), random.uniform(0.1, 2), 1.0},
                  random.uniform(-M_PI, M_PI));
  };
  for (int i = 0; i < 150; ++i) {
    LibraryObject& object = library.create(0.05);
    ids.push_back(object.id);
    library.place(object, random_box());
  }
  // Some move, some go: what was filed must follow.
  for (int i = 0; i < 60; ++i) library.place(*library.find(ids[i]), random_box());
  for (int i = 130; i < 150; ++i) library.erase(ids[i]);
  int listed = 0;
  for (int q = 0; q < 500; ++q) {
    const Eigen::Vector3d center(random.uniform(-25, 25), random.uniform(-25, 25),
                                 random.uniform(-1, 3));
    const double radius = random.uniform(0.0, 5.0);
    const std::vector<ObjectId> near = library.near(center, radius);
    listed += static_cast<int>(near.size());
    ASSERT_TRUE(std::is_sorted(near.begin(), near.end()));
    ASSERT_EQ(std::adjacent_find(near.begin(), near.end()), near.end()) << "each once";
    for (const auto& [id, object] : library.all()) {
      const bool is_listed = std::binary_search(near.begin(), near.end(), id);
      const double distance = distance_to(object->box, center);
      if (distance <= radius) {
        ASSERT_TRUE(is_listed) << to_index(id);
      }
      // "May lie": a grid answers by cells. Farther than the box's own reach, the square around the
      // circle and two cells of 2 m is none of them.
      if (distance > 1.5 * radius + 0.5 * object->box.size_m.head<2>().norm() + 6.0) {
        ASSERT_FALSE(is_listed) << to_index(id);
      }
    }
  }
  EXPECT_GT(listed, 500);
}

TEST(ObjectLibrary, CostOfAQueryDoesNotGrowWithTheRest) {
  ObjectLibrary library;
  for (int i = 0; i < 2000; ++i) library.place(library.create(0.05), box_at(10.0 * i, 0));
  EXPECT_EQ(library.near({5000, 0, 0}, 1.0).size(), 1u);
  EXPECT_TRUE(library.near({5005, 0, 0}, 1.0).empty());
}

// Candidates come and go all day, also when nobody asks any more what has changed.
TEST(ObjectLibrary, WhatCameAndWentSinceItWasAskedIsNotListed) {
  ObjectLibrary library;
  const ObjectId old = library.create(0.05).id;
  EXPECT_EQ(library.take_touched(), std::set<ObjectId>{old});
  ObjectId stays = ObjectId::kNone;
  for (int i = 0; i < 10; ++i) {
    const ObjectId id = library.create(0.05).id;
    if (i == 5) {
      stays = id;
    } else {
      library.erase(id);
    }
  }
  EXPECT_EQ(library.take_touched(), std::set<ObjectId>{stays});
  library.erase(old);
  // Known under one name, then under another that nobody heard of.
  const ObjectId reserved = library.reserve_id();
  library.rename(stays, reserved);
  library.erase(reserved);
  EXPECT_EQ(library.take_touched(), (std::set<ObjectId>{old, stays}));
}

TEST(ObjectLibrary, RenameKeepsTheObjectAndItsPlace) {
  ObjectLibrary library;
  LibraryObject& object = library.create(0.05);
  const ObjectId old = object.id;
  object.class_id = 7;
  object.observations = 42;
  library.place(object, box_at(3, 4));
  library.rename(old, ObjectId{900});
  EXPECT_EQ(library.find(old), nullptr);
  EXPECT_EQ(library.find(ObjectId{900}), &object) << "pointers stay valid";
  EXPECT_EQ(object.id, ObjectId{900});
  EXPECT_EQ(object.observations, 42u);
  EXPECT_EQ(library.near({3, 4, 0}, 0.1), std::vector<ObjectId>{ObjectId{900}});
  EXPECT_EQ(library.size(), 1u);
}

TEST(ObjectLibrary, RenameRefusesTakenAndUnknownIds) {
  ObjectLibrary library;
  const ObjectId a = library.create(0.05).id, b = library.create(0.05).id;
  EXPECT_THROW(library.rename(a, b), std::logic_error);
  EXPECT_THROW(library.rename(ObjectId{50}, ObjectId{60}), std::logic_error);
  EXPECT_EQ(library.size(), 2u);
}

TEST(ObjectLibrary, SnapshotCopiesWhatOthersSee) {
  LibraryObject object(ObjectId{5}, 0.05);
  object.class_id = 7;
  object.stationarity_class = 1;
  object.box = box_at(1, 2, {0.6, 0.4, 1.2}, 0.5);
  object.centroid_W = {1.1, 2.1, 0.8};
  object.belief = {0.01, 0.1, 6, 2};
  object.first_seen_ns = 10;
  object.last_seen_ns = 20;
  object.observations = 9;
  object.last_robot = "r2";
  const ObjectSnapshot s = snapshot(object);
  EXPECT_EQ(s.id, ObjectId{5});
  EXPECT_EQ(s.class_id, 7);
  EXPECT_EQ(s.stationarity_class, 1);
  EXPECT_EQ(s.box.size_m, object.box.size_m);
  EXPECT_EQ(s.belief.stationarity(), 0.75);
  EXPECT_EQ(s.first_seen_ns, 10);
  EXPECT_EQ(s.last_seen_ns, 20);
  EXPECT_EQ(s.observations, 9u);
  EXPECT_EQ(s.last_robot, "r2");
  // The pose: where the box is on the ground, at the mean height of the surface.
  EXPECT_EQ(s.pose().position_W, Eigen::Vector3d(1, 2, 0.8));
  EXPECT_EQ(s.pose().yaw_rad, 0.5);
}

}  // namespace
}  // namespace pocd
