// Values to bytes and back.
#include <gtest/gtest.h>

#include "memory/stored_state.hpp"
#include "pocd/common/archive.hpp"
#include "pocd/common/random.hpp"

namespace pocd {

/// One of everything.
struct Sample {
  enum class Colour : std::uint8_t { kRed, kGreen };
  bool flag = false;
  std::int16_t small = 0;
  double number = 0.0;
  Colour colour = Colour::kRed;
  std::string text;
  std::vector<std::string> list;
  std::optional<double> maybe;
  std::set<std::int32_t> set;
  std::map<std::string, std::vector<float>> map;
  std::deque<std::pair<std::uint32_t, std::uint8_t>> pairs;
  std::array<std::uint16_t, 3> three{};
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
};

template <class Archive>
void archive(Archive& a, Sample& s) {
  a.version(3);
  a(s.flag, s.small, s.number, s.colour, s.text, s.list, s.maybe, s.set, s.map, s.pairs, s.three,
    s.vector, s.pose);
}

namespace {

Sample random_sample(Random& random) {
  Sample s;
  s.flag = random.below(2) == 1;
  s.small = static_cast<std::int16_t>(random.below(65536));
  s.number = random.uniform() - 0.5;
  s.colour = random.below(2) == 1 ? Sample::Colour::kGreen : Sample::Colour::kRed;
  s.text = std::string(random.below(20), 'x');
  for (std::uint64_t i = random.below(4); i > 0; --i) s.list.push_back("line " + std::to_string(i));
  if (random.below(2) == 1) s.maybe = random.uniform();
  for (std::uint64_t i = random.below(5); i > 0; --i) {
    s.set.insert(static_cast<std::int32_t>(random.below(100)));
    s.map[std::to_string(i)].assign(i, 0.25f);
    s.pairs.emplace_back(static_cast<std::uint32_t>(i), static_cast<std::uint8_t>(3));
  }
  s.three = {1, 2, static_cast<std::uint16_t>(random.below(9))};
  s.vector = {random.uniform(), -random.uniform(), 1e300};
  s.pose.translation() = s.vector;
  return s;
}

TEST(Archive, GivesBackEveryBit) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Sample sample = random_sample(random);
    const std::vector<std::uint8_t> bytes = archived(sample);
    Sample copy;
    copy.list = {"what was there before"};
    unarchive(bytes, "test", copy);
    EXPECT_EQ(archived(copy), bytes);
    EXPECT_EQ(copy.text, sample.text);
    EXPECT_EQ(copy.maybe, sample.maybe);
    EXPECT_EQ(copy.map, sample.map);
    EXPECT_EQ(copy.pairs, sample.pairs);
  }
}

TEST(Archive, BytesThatAreNoneAreRefusedWithinBoundedMemory) {
  Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<std::uint8_t> bytes = archived(random_sample(random));
    const bool cut = random.below(2) == 0;
    if (cut) {
      bytes.resize(random.below(bytes.size()));
    } else {
      for (int i = 0; i < 3; ++i) {
        bytes[random.below(bytes.size())] = static_cast<std::uint8_t>(random.below(256));
      }
    }
    Sample copy;
    try {
      unarchive(bytes, "here", copy);
      EXPECT_FALSE(cut);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("here: ", 0), 0u);
    }
  }
}

TEST(Archive, NamesALayoutThatItDoesNotKnow) {
  std::vector<std::uint8_t> bytes = archived(Sample());
  bytes[0] = 4;
  Sample copy;
  try {
    unarchive(bytes, "here", copy);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "here: layout 4, this program knows 3");
  }
}

TEST(Archive, BytesThatAreLeftAreAnError) {
  std::vector<std::uint8_t> bytes = archived(Sample());
  bytes.push_back(0);
  Sample copy;
  EXPECT_THROW(unarchive(bytes, "here", copy), InputError);
}

// The log of events is kept for years: one of before there were arrivals is read.
TEST(StoredEvent, OneOfAnOlderLayoutHasAnUnknownArrival) {
  ObjectEvent event;
  event.kind = EventKind::kAdded;
  event.arrival = Arrival::kArrived;
  event.robot = "robot1";
  event.by = "somebody";
  std::vector<std::uint8_t> bytes = archived(event);
  ObjectEvent read;
  unarchive(bytes, "row", read);
  EXPECT_EQ(read.arrival, Arrival::kArrived);
  bytes.back() = 7;
  EXPECT_THROW(unarchive(bytes, "row", read), InputError);
  bytes.pop_back();  // layout 1 ended here
  EXPECT_THROW(unarchive(bytes, "row", read), InputError);
  bytes.front() = 1;
  ObjectEvent old;
  unarchive(bytes, "row", old);
  EXPECT_EQ(old.arrival, Arrival::kUnknown);
  EXPECT_EQ(old.robot, "robot1");
  EXPECT_EQ(old.by, "somebody");
  bytes.front() = 3;
  EXPECT_THROW(unarchive(bytes, "row", old), InputError);
}

}  // namespace
}  // namespace pocd
