// What a viewer asks of something that is played. The bytes are those that the tests of
// foxglove-sdk write down for the same requests and states.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pocd/common/random.hpp"
#include "view/playback.hpp"

namespace pocd::view {
namespace {

using std::chrono::milliseconds;
constexpr StampNs kSecond = 1000000000;

std::string bytes(std::initializer_list<int> list) {
  std::string text;
  for (const int byte : list) text.push_back(static_cast<char>(byte));
  return text;
}

PlaybackRequest request(bool play, float speed = 1.0F, std::optional<StampNs> seek = std::nullopt) {
  PlaybackRequest one;
  one.play = play;
  one.speed = speed;
  if (seek) one.seek_ns = static_cast<std::uint64_t>(*seek);
  one.id = "some-id";
  return one;
}

// Play at 1.0 from 123 456 789 ns on.
const std::string kPlayWithSeek =
    bytes({3, 0, 0, 0, 0x80, 0x3f, 1, 0x15, 0xcd, 0x5b, 7, 0, 0, 0, 0, 7, 0, 0, 0}) + "some-id";

TEST(PlaybackRequest, IsReadAsTheProtocolHasIt) {
  const auto play = playback_request_from(kPlayWithSeek);
  ASSERT_TRUE(play);
  EXPECT_TRUE(play->play);
  EXPECT_EQ(play->speed, 1.0F);
  EXPECT_EQ(play->seek_ns, 123456789u);
  EXPECT_EQ(play->id, "some-id");
  // Without a seek the time is there, too, and means nothing.
  const auto pause = playback_request_from(
      bytes({3, 1, 0, 0, 0, 0x40, 0, 1, 2, 3, 4, 5, 6, 7, 8, 1, 0, 0, 0}) + "x");
  ASSERT_TRUE(pause);
  EXPECT_FALSE(pause->play);
  EXPECT_EQ(pause->speed, 2.0F);
  EXPECT_FALSE(pause->seek_ns);
  EXPECT_EQ(pause->id, "x");
}

TEST(PlaybackRequest, WhatIsNoneIsRefused) {
  for (std::size_t size = 0; size < kPlayWithSeek.size(); ++size) {
    EXPECT_FALSE(playback_request_from(kPlayWithSeek.substr(0, size))) << size;
  }
  std::string wrong = kPlayWithSeek;
  wrong[0] = 1;
  EXPECT_FALSE(playback_request_from(wrong)) << "another opcode";
  wrong = kPlayWithSeek;
  wrong[1] = 2;
  EXPECT_FALSE(playback_request_from(wrong)) << "another command";
  for (const int length : {8, 0x7fffffff, -1}) {
    wrong = kPlayWithSeek;
    for (int i = 0; i < 4; ++i) wrong[15 + i] = static_cast<char>(length >> (8 * i));
    EXPECT_FALSE(playback_request_from(wrong)) << "an id of " << length;
  }
  wrong = kPlayWithSeek.substr(0, 15) + bytes({1, 1, 0, 0}) + std::string(257, 'x');
  EXPECT_FALSE(playback_request_from(wrong)) << "an id that is too long";
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    std::string noise(random.below(60), '\0');
    for (char& byte : noise) byte = static_cast<char>(random.below(256));
    if (!noise.empty()) noise[0] = kPlaybackRequestOpcode;
    playback_request_from(noise);
  }
}

TEST(PlaybackState, IsWrittenAsTheProtocolHasIt) {
  PlaybackState state;
  state.status = PlaybackStatus::kPlaying;
  state.time_ns = 12345;
  EXPECT_EQ(message_of(state),
            bytes({5, 0, 0x39, 0x30, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0, 0, 0}));
  state.status = PlaybackStatus::kEnded;
  state.did_seek = true;
  state.request = "i-am-a-request";
  EXPECT_EQ(message_of(state),
            bytes({5, 3, 0x39, 0x30, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 1, 14, 0, 0, 0}) +
                "i-am-a-request");
}

TEST(PlaybackClock, StandsAtTheEndAndPlaysFromTheStart) {
  PlaybackClock clock(100 * kSecond, 110 * kSecond);
  PlaybackClock::Wall now{};
  EXPECT_EQ(clock.state(now).status, PlaybackStatus::kEnded);
  EXPECT_EQ(clock.state(now).time_ns, 110 * kSecond);
  PlaybackState state;
  ASSERT_TRUE(clock.apply(request(true, 2.0F), now, state));
  EXPECT_EQ(state.status, PlaybackStatus::kPlaying);
  EXPECT_EQ(state.time_ns, 100 * kSecond);
  EXPECT_TRUE(state.did_seek);
  EXPECT_EQ(state.request, "some-id");
  state = clock.state(now += milliseconds(1500));
  EXPECT_EQ(state.time_ns, 103 * kSecond);
  EXPECT_EQ(state.speed, 2.0F);
  EXPECT_TRUE(state.request.empty());
  // Another speed goes on from where it is; a pause stands.
  ASSERT_TRUE(clock.apply(request(true, 0.5F), now, state));
  EXPECT_FALSE(state.did_seek);
  EXPECT_EQ(clock.state(now += milliseconds(2000)).time_ns, 104 * kSecond);
  ASSERT_TRUE(clock.apply(request(false), now, state));
  EXPECT_EQ(state.status, PlaybackStatus::kPaused);
  EXPECT_EQ(clock.state(now += milliseconds(9000)).time_ns, 104 * kSecond);
  ASSERT_TRUE(clock.apply(request(true), now, state));
  state = clock.state(now += milliseconds(6001));
  EXPECT_EQ(state.time_ns, 110 * kSecond);
  EXPECT_EQ(state.status, PlaybackStatus::kEnded);
  EXPECT_FALSE(clock.playing());
}

TEST(PlaybackClock, SeeksWithinTheRangeOnly) {
  PlaybackClock clock(100 * kSecond, 110 * kSecond);
  PlaybackClock::Wall now{};
  PlaybackState state;
  ASSERT_TRUE(clock.apply(request(false, 1.0F, 105 * kSecond), now, state));
  EXPECT_EQ(state.status, PlaybackStatus::kPaused);
  EXPECT_EQ(state.time_ns, 105 * kSecond);
  EXPECT_TRUE(state.did_seek);
  ASSERT_TRUE(clock.apply(request(true, 1.0F, 0), now, state));
  EXPECT_EQ(state.time_ns, 100 * kSecond);
  ASSERT_TRUE(clock.apply(request(true, 1.0F, -1), now, state))
      << "the largest number that there is";
  EXPECT_EQ(state.time_ns, 110 * kSecond);
  EXPECT_EQ(state.status, PlaybackStatus::kEnded);
}

TEST(PlaybackClock, ASpeedThatIsNoneChangesNothing) {
  PlaybackClock clock(100 * kSecond, 110 * kSecond);
  PlaybackState state;
  ASSERT_TRUE(clock.apply(request(false, 1.0F, 105 * kSecond), {}, state));
  for (const float speed : {0.0F, -1.0F, 1e6F, std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity()}) {
    EXPECT_FALSE(clock.apply(request(true, speed, 101 * kSecond), {}, state)) << speed;
    EXPECT_EQ(state.time_ns, 105 * kSecond);
    EXPECT_EQ(state.speed, 1.0F);
    EXPECT_EQ(state.status, PlaybackStatus::kPaused);
    EXPECT_EQ(state.request, "some-id") << "it is answered all the same";
  }
}

TEST(PlaybackClock, OfAnEmptyRangeNothingIsPlayed) {
  PlaybackClock clock(100 * kSecond, 100 * kSecond);
  PlaybackState state;
  ASSERT_TRUE(clock.apply(request(true), {}, state));
  EXPECT_EQ(state.status, PlaybackStatus::kEnded);
}

}  // namespace
}  // namespace pocd::view
