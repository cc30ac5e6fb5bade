// ADDED says whether the thing came while the system knew of the place.
#include <gtest/gtest.h>

#include "drive.hpp"

namespace pocd {
namespace {

using test::Drive;
using test::kBoxClass;
using test::kCageClass;
using test::room_with;
using test::solid;

SceneObject box() { return solid(kBoxClass, {-0.6, 2.3}, {0.6, 0.4, 0.6}); }
SceneObject cage() { return solid(kCageClass, {0.7, 2.4}, {0.5, 0.5, 0.8}, 0.3); }

TEST(PipelineArrival, WhatStoodThereIsFoundAndWhatCameArrived) {
  Drive drive;
  drive.watch(room_with({box()}), 25);
  drive.watch(room_with({box(), cage()}), 25);
  const auto added = drive.of_kind(EventKind::kAdded);
  ASSERT_EQ(added.size(), 2u) << test::text(drive.events());
  EXPECT_EQ(added[0].class_id, kBoxClass);
  EXPECT_EQ(added[0].arrival, Arrival::kFound) << "its place was never seen empty";
  EXPECT_EQ(added[1].class_id, kCageClass);
  EXPECT_EQ(added[1].arrival, Arrival::kArrived) << "its place was seen empty before";
}

TEST(PipelineArrival, OnlyAddedHasOne) {
  Drive drive;
  drive.watch(room_with({}), 25);
  drive.watch(room_with({box()}), 25);
  drive.watch(room_with({}), 25);
  const auto removed = drive.of_kind(EventKind::kRemoved);
  ASSERT_EQ(removed.size(), 1u) << test::text(drive.events());
  EXPECT_EQ(removed[0].arrival, Arrival::kUnknown);
}

}  // namespace
}  // namespace pocd
