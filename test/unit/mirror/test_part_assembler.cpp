// Steps from their parts, which come twice, late, or not at all.
#include <gtest/gtest.h>

#include "mirror/part_assembler.hpp"

namespace pocd::dds {
namespace {

struct Part {
  std::uint32_t number = 0, count = 0;
  std::uint32_t part() const { return number; }
  std::uint32_t part_count() const { return count; }
};

TEST(PartAssembler, GivesAStepOnceAllPartsAreThereInOrder) {
  PartAssembler<int, Part> parts;
  EXPECT_FALSE(parts.add(1, {2, 3}));
  EXPECT_FALSE(parts.add(1, {0, 3}));
  EXPECT_FALSE(parts.add(1, {0, 3})) << "a part that comes twice";
  EXPECT_FALSE(parts.add(2, {1, 3})) << "of another step";
  const auto step = parts.add(1, {1, 3});
  ASSERT_TRUE(step);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ((*step)[i].number, i);
  EXPECT_TRUE(parts.add(3, {0, 1}));
}

TEST(PartAssembler, RefusesNumbersThatCannotBe) {
  PartAssembler<int, Part> parts;
  EXPECT_FALSE(parts.add(1, {0, 0}));
  EXPECT_FALSE(parts.add(1, {5, 5}));
  EXPECT_FALSE(parts.add(1, {0, 4'000'000'000})) << "no memory is taken for it";
  EXPECT_FALSE(parts.add(2, {0, 2}));
  EXPECT_FALSE(parts.add(2, {1, 3})) << "says another count than the first one";
  EXPECT_TRUE(parts.add(2, {1, 2}));
}

TEST(PartAssembler, ForgetsTheOldestOfTooMany) {
  PartAssembler<int, Part> parts;
  for (int step = 1; step <= 17; ++step) EXPECT_FALSE(parts.add(step, {0, 2}));
  EXPECT_FALSE(parts.add(1, {1, 2})) << "was forgotten";
  EXPECT_TRUE(parts.add(17, {1, 2}));
}

// Keys begin with the random name of a run: a new run's may be the smallest of all.
TEST(PartAssembler, LeftoversDoNotPushOutWhatGrows) {
  PartAssembler<int, Part> parts;
  for (int step = 1; step <= 16; ++step) EXPECT_FALSE(parts.add(1000 + step, {0, 2}));
  EXPECT_FALSE(parts.add(1, {0, 3}));
  EXPECT_FALSE(parts.add(1, {1, 3}));
  EXPECT_TRUE(parts.add(1, {2, 3}));
}

TEST(PartAssembler, DropsWhatIsNotWantedAnyMore) {
  PartAssembler<int, Part> parts;
  EXPECT_FALSE(parts.add(1, {0, 2}));
  EXPECT_FALSE(parts.add(2, {0, 2}));
  parts.keep([](int step) { return step > 1; });
  EXPECT_FALSE(parts.add(1, {1, 2}));
  EXPECT_TRUE(parts.add(2, {1, 2}));
}

}  // namespace
}  // namespace pocd::dds
