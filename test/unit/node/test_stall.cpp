// Whether Fast DDS's discovery stands still, and what is said of it.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "entities/open_calls.hpp"
#include "entities/stall_note.hpp"

namespace pocd::dds {
namespace {

OpenCalls::Clock::time_point at(double second) {
  return OpenCalls::Clock::time_point{} +
         std::chrono::milliseconds(static_cast<long>(1e3 * second));
}

TEST(OpenCalls, TheLongestCountsAndOnlyWhileItIsOpen) {
  OpenCalls calls;
  EXPECT_EQ(calls.longest_s(at(1)), 0.0);
  auto first = std::make_unique<OpenCalls::Call>(calls, at(1));
  auto second = std::make_unique<OpenCalls::Call>(calls, at(3));
  EXPECT_DOUBLE_EQ(calls.longest_s(at(13)), 12.0);
  first.reset();
  EXPECT_DOUBLE_EQ(calls.longest_s(at(13)), 10.0);
  second.reset();
  EXPECT_EQ(calls.longest_s(at(13)), 0.0);
}

TEST(OpenCalls, MoreThanThereIsRoomForHarmNobody) {
  OpenCalls calls;
  std::vector<std::unique_ptr<OpenCalls::Call>> many;
  for (int i = 0; i < 1000; ++i) many.push_back(std::make_unique<OpenCalls::Call>(calls, at(i)));
  EXPECT_DOUBLE_EQ(calls.longest_s(at(1000)), 1000.0);
  many.clear();
  EXPECT_EQ(calls.longest_s(at(1000)), 0.0);
  const OpenCalls::Call again(calls, at(2000));
  EXPECT_DOUBLE_EQ(calls.longest_s(at(2001)), 1.0) << "the room is free again";
}

TEST(StallNote, SaysOnceThatItHangsAndOnceThatItGoesOn) {
  OpenCalls calls;
  StallNote note("discovery", "start it anew", 10.0);
  EXPECT_FALSE(note.look(calls.longest_s(at(1))));
  auto blocked = std::make_unique<OpenCalls::Call>(calls, at(1));
  EXPECT_FALSE(note.look(calls.longest_s(at(10.9))));
  const auto hangs = note.look(calls.longest_s(at(11)));
  ASSERT_TRUE(hangs);
  EXPECT_TRUE(hangs->hangs);
  EXPECT_EQ(hangs->text, "discovery has not ended a turn for 10 s: start it anew");
  EXPECT_FALSE(note.look(calls.longest_s(at(20)))) << "said already";
  EXPECT_EQ(note.stalls(), 1u);
  blocked.reset();
  const auto over = note.look(calls.longest_s(at(21)));
  ASSERT_TRUE(over);
  EXPECT_FALSE(over->hangs);
  EXPECT_EQ(over->text, "discovery goes on after more than 19 s");
  EXPECT_FALSE(note.look(calls.longest_s(at(22))));
  const OpenCalls::Call another(calls, at(30));
  EXPECT_TRUE(note.look(calls.longest_s(at(45)))) << "it hangs once more";
  EXPECT_EQ(note.stalls(), 2u);
}

}  // namespace
}  // namespace pocd::dds
