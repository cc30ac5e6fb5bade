// ADDED says whether the thing came while the system knew of the place.
#include <gtest/gtest.h>

#include "drive.hpp"

namespace pocd {
namespace {

using test::Drive;
using test::kBoxClass;
using test::kCageClass;
using test::left_box;
using test::right_cage;
using test::room_with;

TEST(PipelineArrival, WhatStoodThereIsFoundAndWhatCameArrived) {
  Drive drive;
  drive.watch(room_with({left_box()}), 25);
  drive.watch(room_with({left_box(), right_cage()}), 25);
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
  drive.watch(room_with({left_box()}), 25);
  drive.watch(room_with({}), 25);
  const auto removed = drive.of_kind(EventKind::kRemoved);
  ASSERT_EQ(removed.size(), 1u) << test::text(drive.events());
  EXPECT_EQ(removed[0].arrival, Arrival::kUnknown);
}

}  // namespace
}  // namespace pocd
