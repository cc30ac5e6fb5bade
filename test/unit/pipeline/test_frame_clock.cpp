// Clocks of robots that disagree: the majority is right, and nobody is silenced for ever.
#include "../../../pocd_core/src/pipeline/frame_clock.hpp"

#include <gtest/gtest.h>

#include <map>

namespace pocd {
namespace {

using Verdict = FrameClock::Verdict;
constexpr StampNs kSecond = 1'000'000'000;

/// Robots at 10 Hz, one after the other; robot n's clock is off by offset_s[n].
class Fleet {
 public:
  explicit Fleet(std::vector<int> offset_s) : offset_s_(std::move(offset_s)) {}

  void run(int rounds) {
    for (int i = 0; i < rounds; ++i) {
      for (std::size_t r = 0; r < offset_s_.size(); ++r) show(r);
      now_ns_ += kSecond / 10;
    }
  }
  Verdict show(std::size_t robot) {
    const Verdict verdict =
        clock_.judge("r" + std::to_string(robot), now_ns_ + offset_s_[robot] * kSecond);
    ++counts_[robot][verdict];
    return verdict;
  }
  int count(std::size_t robot, Verdict verdict) { return counts_[robot][verdict]; }
  int count(Verdict verdict) {
    int sum = 0;
    for (auto& [robot, counts] : counts_) sum += counts[verdict];
    return sum;
  }
  void forget_counts() { counts_.clear(); }
  void pass(int seconds) { now_ns_ += seconds * kSecond; }

 private:
  std::vector<int> offset_s_;
  StampNs now_ns_ = 1000 * kSecond;
  FrameClock clock_;
  std::map<std::size_t, std::map<Verdict, int>> counts_;
};

/// Whichever robot comes first, and however many healthy ones there are.
TEST(FrameClock, OneClockAheadSilencesNobody) {
  for (int healthy = 2; healthy <= 12; ++healthy) {
    for (const int wrong : {0, healthy / 2, healthy}) {
      for (const int offset_s : {20, -20, 100000}) {
        std::vector<int> offsets(static_cast<std::size_t>(healthy) + 1, 0);
        offsets[static_cast<std::size_t>(wrong)] = offset_s;
        Fleet fleet(offsets);
        fleet.run(20);  // two seconds until they have agreed
        fleet.forget_counts();
        fleet.run(300);
        for (int r = 0; r <= healthy; ++r) {
          EXPECT_EQ(fleet.count(static_cast<std::size_t>(r), Verdict::kGoesOn),
                    r == wrong ? 0 : 300)
              << healthy << " healthy, robot " << wrong << " off by " << offset_s;
        }
        EXPECT_EQ(fleet.count(Verdict::kSetBack), 0) << "stamps are rewritten once at most";
      }
    }
  }
}

TEST(FrameClock, OfTwoTheFirstIsRight) {
  for (const int offset_s : {20, -20}) {
    Fleet fleet({0, offset_s});
    fleet.run(100);
    EXPECT_EQ(fleet.count(0, Verdict::kGoesOn), 100);
    EXPECT_EQ(fleet.count(1, offset_s > 0 ? Verdict::kAhead : Verdict::kBehind), 100);
  }
}

TEST(FrameClock, OneRobotIsItsOwnMajority) {
  Fleet fleet({0});
  fleet.run(30);
  fleet.pass(3600);
  fleet.run(30);
  EXPECT_EQ(fleet.count(Verdict::kGoesOn), 60) << "a pause";
  fleet.pass(-4000);
  fleet.run(30);
  EXPECT_EQ(fleet.count(Verdict::kBehind), 9) << "a replay that starts again";
  EXPECT_EQ(fleet.count(Verdict::kSetBack), 1);
  EXPECT_EQ(fleet.count(Verdict::kGoesOn), 80);
}

TEST(FrameClock, AFleetPausesAndReplaysAsOne) {
  Fleet fleet({0, 1, -1, 2, 0});
  fleet.run(30);
  fleet.forget_counts();
  fleet.pass(600);
  fleet.run(30);
  EXPECT_GE(fleet.count(Verdict::kGoesOn), 148) << "the third robot is the majority";
  EXPECT_EQ(fleet.count(Verdict::kSetBack), 0);
  fleet.forget_counts();
  fleet.pass(-600);
  fleet.run(30);
  EXPECT_EQ(fleet.count(Verdict::kSetBack), 1);
  EXPECT_GE(fleet.count(Verdict::kGoesOn), 150 - 12);
}

TEST(FrameClock, ARobotThatIsSilentHasNoVoice) {
  Fleet fleet({0, 0, 0});
  fleet.run(30);
  // Two stop; the third goes on for an hour, and so does everything when they come back.
  for (int i = 0; i < 400; ++i) {
    fleet.pass(9);
    EXPECT_EQ(fleet.show(2), Verdict::kGoesOn);
  }
  EXPECT_EQ(fleet.show(0), Verdict::kGoesOn);
  // After a pause, one that starts alone is followed as soon as the others are forgotten.
  fleet.pass(100);
  int refused = 0;
  while (fleet.show(1) != Verdict::kGoesOn) ++refused;
  EXPECT_LE(refused, 30);
}

TEST(FrameClock, StampsMayBeAnything) {
  FrameClock clock;
  EXPECT_EQ(clock.judge("a", std::numeric_limits<StampNs>::min()), Verdict::kGoesOn);
  EXPECT_EQ(clock.judge("a", std::numeric_limits<StampNs>::max()), Verdict::kGoesOn);
  EXPECT_EQ(clock.judge("b", std::numeric_limits<StampNs>::min()), Verdict::kBehind);
}

TEST(FrameClock, NamesWithoutEndHaveNoMoreVoicesThanRobotsAreKept) {
  FrameClock clock;
  for (int i = 0; i < 1000; ++i) clock.judge("steady", i * kSecond);
  for (int i = 1000; i < 4000; ++i) {
    EXPECT_EQ(clock.judge("name" + std::to_string(i), i * kSecond), Verdict::kGoesOn);
    ASSERT_LE(clock.robots(), PoseGate::kMostRobots);
  }
}

}  // namespace
}  // namespace pocd
