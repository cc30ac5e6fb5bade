// Clocks that are set back, of all robots or of one.
#include <gtest/gtest.h>

#include <algorithm>

#include "drive.hpp"

namespace pocd {
namespace {

using test::Drive;
using test::kBoxClass;
using test::kCageClass;
using test::kLearn;
using test::kPromptly;
using test::kSize;
using test::left_box;
using test::right_cage;
using test::room_with;
using test::solid;
using test::text;

// A replay that starts again: what is known is known from before, and its changes are found as if
// the clocks had gone on.
TEST(PipelineClocks, ClocksThatAreSetBackLoseNothing) {
  constexpr StampNs kHour = 3600'000'000'000;
  const auto drive_with = [](StampNs first_later_ns, Drive& drive) {
    const auto watch = [&](const Scene& scene, int frames, StampNs later_ns) {
      int used = 0;
      for (int i = 0; i < frames; ++i) {
        Frame frame = drive.next_frame(scene);
        frame.stamp_ns += later_ns;
        used += drive.process(frame).accepted;
      }
      return used;
    };
    const Scene before = room_with({left_box(), right_cage()});
    watch(before, kLearn, first_later_ns);
    const int used = watch(before, 20, 0);
    // Gone, and found elsewhere at once and after a while.
    const SceneObject moved_box = solid(kBoxClass, {-0.6, 1.5}, kSize);
    watch(room_with({moved_box}), 2 * kPromptly, 0);
    watch(room_with({moved_box, solid(kCageClass, {0.9, 1.6}, {0.5, 0.5, 0.8}, 0.3)}),
          2 * kPromptly, 0);
    return used;
  };
  Drive steady, set_back;
  EXPECT_EQ(drive_with(0, steady), 20);
  EXPECT_EQ(drive_with(kHour, set_back), 11) << "nine frames may be another robot's wrong clock";
  // Nine frames fewer were used: when a box is known better may differ, what changed does not.
  const auto changes = [](const Drive& drive) {
    std::vector<ObjectEvent> list = drive.events();
    list.erase(std::remove_if(list.begin(), list.end(),
                              [](const ObjectEvent& e) { return e.kind == EventKind::kUpdated; }),
               list.end());
    return text(list);
  };
  EXPECT_EQ(changes(set_back), changes(steady));
  EXPECT_EQ(set_back.of_kind(EventKind::kMoved).size(), 2u) << text(set_back.events());
  ASSERT_TRUE(set_back.object_at(-0.6, 1.5));
  EXPECT_LT(set_back.object_at(-0.6, 1.5)->last_seen_ns, kHour);
}

// A recording that is played again and again: what departed on earlier laps is not kept for ever,
// though no stamp of a lap is older than the window.
TEST(PipelineClocks, AReplayThatStartsAgainAndAgainKeepsNoMoreOfWhatDeparted) {
  constexpr StampNs kPeriod = 500'000'000;  // a lap of 30 s, of a window of 60 s
  constexpr int kLap = 60, kLaps = 12;
  Drive drive;
  std::uint64_t parts = 0;  // bytes of what is kept beside objects and map
  const auto lap = [&] {
    for (int i = 0; i < kLap; ++i) {
      const bool there = i < kLap / 2;
      Frame frame = drive.next_frame(there ? room_with({left_box(), right_cage()})
                                           : room_with({right_cage()}));
      frame.stamp_ns = i * kPeriod;
      drive.process(frame);
    }
    for (const Piece& piece : drive.pipeline().take_changed_pieces()) {
      if (piece.kind == PieceKind::kPart && piece.bytes.size() > 1000) parts = piece.bytes.size();
    }
    return parts;
  };
  std::vector<std::uint64_t> bytes;
  for (int i = 0; i < kLaps; ++i) bytes.push_back(lap());
  const auto removed = drive.of_kind(EventKind::kRemoved);
  EXPECT_GE(removed.size(), kLaps - 2u) << "each lap has one";
  EXPECT_GT(bytes[3], 0u);
  EXPECT_LT(bytes[kLaps - 1], bytes[3] + bytes[3] / 4) << text(drive.events());
}

// One robot's clock is an hour behind: its frames are refused as long as others go on.
TEST(PipelineClocks, ARobotWithAWrongClockDisturbsNobody) {
  Drive drive;
  const Scene scene = room_with({left_box(), right_cage()});
  for (int i = 0; i < 60; ++i) {
    Frame frame = drive.next_frame(scene);
    const bool wrong = i % 2 == 1;
    frame.robot = wrong ? "late" : "good";
    if (!wrong) frame.stamp_ns += 3600'000'000'000;
    const FrameResult result = drive.process(frame);
    EXPECT_EQ(result.accepted, !wrong);
    if (!wrong) continue;
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_EQ(result.warnings[0].find("late: stamp is 3599.9 s behind the newest: frame not used"),
              0u)
        << result.warnings[0];
  }
  EXPECT_EQ(drive.of_kind(EventKind::kAdded).size(), 2u) << text(drive.events());
}

}  // namespace
}  // namespace pocd
