// Whom a copy follows when several say that they publish its map.
#include <gtest/gtest.h>

#include <set>

#include "mirror/publishers.hpp"

namespace pocd::dds {
namespace {

using std::chrono::seconds;
using Writer = Publishers::Writer;

const Writer kA{1}, kB{2};

class PublishersTest : public testing::Test {
 protected:
  Publishers publishers;
  Publishers::Time now{};
  bool heard(const Writer& writer, std::uint64_t epoch, bool final_version = false) {
    return publishers.heard(writer, epoch, final_version, now);
  }
};

TEST_F(PublishersTest, TheFirstIsFollowedAsLongAsItSpeaks) {
  EXPECT_FALSE(publishers.present());
  for (int second = 0; second < 10; ++second, now += seconds(1)) {
    EXPECT_TRUE(heard(kA, 1));
    EXPECT_FALSE(heard(kB, 2));
  }
  EXPECT_EQ(publishers.followed(), 1u);
  EXPECT_EQ(publishers.rivals(now), std::vector<std::uint64_t>{2});
  EXPECT_TRUE(publishers.foreign(2, now));
  EXPECT_FALSE(publishers.foreign(1, now));
  EXPECT_FALSE(publishers.foreign(9, now)) << "may be a new run, of which the manifest is to come";
}

TEST_F(PublishersTest, OneThatWasKilledIsReplacedWhenItIsSilent) {
  heard(kA, 1);
  now += seconds(2);
  EXPECT_FALSE(heard(kB, 2)) << "the other one may still be there";
  now += seconds(2);
  EXPECT_TRUE(heard(kB, 2));
  EXPECT_EQ(publishers.followed(), 2u);
  EXPECT_TRUE(publishers.rivals(now).empty());
  EXPECT_TRUE(publishers.present());
}

// Discovery may be later than the first manifest.
TEST_F(PublishersTest, OneThatWasNotMetYetIsThere) {
  heard(kA, 1);
  const auto nobody = [](const Writer&) { return false; };
  publishers.forget_gone(nobody, now);
  EXPECT_TRUE(publishers.present());
  now += seconds(1);
  publishers.forget_gone(nobody, now);
  EXPECT_FALSE(publishers.present()) << "it has never come";
}

TEST_F(PublishersTest, OneThatHasGoneOrEndedIsReplacedAtOnce) {
  heard(kA, 1);
  publishers.forget_gone([](const Writer&) { return true; }, now);
  publishers.forget_gone([](const Writer& writer) { return writer != kA; }, now);
  EXPECT_FALSE(publishers.present());
  EXPECT_EQ(publishers.followed(), 1u) << "nobody else is there";
  EXPECT_TRUE(heard(kB, 2));
  EXPECT_TRUE(heard(kB, 2, true));
  EXPECT_TRUE(publishers.present());
  EXPECT_TRUE(heard(kA, 3));
  // Who has ended repeats its last word to those who join; it is no rival.
  EXPECT_FALSE(heard(kB, 2, true));
  EXPECT_TRUE(publishers.rivals(now).empty());
}

// A node whose threads of the middleware live while its own hang, or one that has been killed.
TEST_F(PublishersTest, SilenceIsThatOfTheOneThatIsFollowedUntilItsRunHasEnded) {
  EXPECT_EQ(publishers.silence(now), seconds(0)) << "nobody is followed";
  heard(kA, 1);
  now += seconds(2);
  heard(kB, 2);
  EXPECT_EQ(publishers.silence(now), seconds(2));
  publishers.forget_gone([](const Writer&) { return true; }, now);
  publishers.forget_gone([](const Writer&) { return false; }, now);
  now += seconds(60);
  EXPECT_EQ(publishers.silence(now), seconds(62)) << "gone without a word";
  heard(kA, 1);
  EXPECT_EQ(publishers.silence(now), seconds(0));
  heard(kA, 1, true);
  now += seconds(60);
  EXPECT_EQ(publishers.silence(now), seconds(0)) << "its run has ended";
}

TEST_F(PublishersTest, AWriterMayGoOnWithAnotherRun) {
  heard(kA, 1);  // a recording of two runs, played by one writer
  EXPECT_TRUE(heard(kA, 2));
  EXPECT_EQ(publishers.followed(), 2u);
}

}  // namespace
}  // namespace pocd::dds
